"""What goes to other computers: an image is built and runs, compose and systemd name what there is."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import yaml
from websockets.sync.client import connect

from tests.processes import free_endpoint, wait_for_listener

ROOT = Path(__file__).parents[1]
PACKAGING = ROOT / "packaging"
Run = Callable[..., str]


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-6000:]}"
    return done.stdout


@pytest.fixture
def buildah(tmp_path: Path) -> Iterator[Run]:
    """Return what runs buildah with a storage of its own."""
    store = tmp_path / "store"
    options = ["--root", store, "--runroot", tmp_path / "runroot", "--storage-driver", "vfs"]
    yield lambda *words: run("buildah", *options, *words)
    shutil.rmtree(store, ignore_errors=True)  # some GB


def why_no_images() -> str:
    if os.geteuid() != 0:
        return "only root builds images without a daemon"
    lacks = [name for name in ("buildah", "mmdebstrap") if shutil.which(name) is None]
    return f"needs {' and '.join(lacks)}: apt-get install {' '.join(lacks)}" if lacks else ""


@pytest.mark.long
@pytest.mark.timeout(1500)
@pytest.mark.skipif(bool(why_no_images()), reason=why_no_images() or "-")
def test_the_image_runs_a_scenario_as_nobody_special(buildah: Run, tmp_path: Path) -> None:
    wheels, base = tmp_path / "wheels", tmp_path / "base.tar"
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--constraint", ROOT / "constraints.txt"]
    run(*pip, "--wheel-dir", wheels, f"{ROOT}[web]", "setuptools", "wheel")
    made = subprocess.run(
        ["mmdebstrap", "--variant=minbase", "--include=python3-venv,ca-certificates", "bookworm", base],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if made.returncode != 0:
        pytest.skip(f"no Debian to build on: {made.stderr.strip().splitlines()[-1:]}")
    empty = buildah("from", "scratch").strip()
    buildah("add", "--quiet", empty, base, "/")
    try:
        buildah("run", "--isolation", "chroot", empty, "--", "true")
    except AssertionError as fault:
        pytest.skip(f"this machine lets nobody change the root: {fault}")
    buildah("commit", "--quiet", "--rm", empty, "twin-base")
    base.unlink()
    buildah(
        "bud", "--isolation", "chroot", "--format", "docker", "--build-arg", "BASE=localhost/twin-base",
        "--build-arg", "PIP_NO_INDEX=1", "--build-arg", "PIP_FIND_LINKS=/wheels",
        "--volume", f"{wheels}:/wheels:ro", "--file", PACKAGING / "Containerfile", "--tag", "twin", ROOT,
    )  # fmt: skip
    image: dict[str, Any] = json.loads(buildah("inspect", "--type", "image", "localhost/twin"))["Docker"]
    config = image["config"]
    assert "9090" in " ".join(config["Healthcheck"]["Test"])
    assert config["ExposedPorts"].keys() == {"7447/tcp", "9090/tcp"}
    container = buildah("from", "localhost/twin").strip()

    def inside(*words: str) -> str:
        return buildah("run", "--isolation", "chroot", container, "--", *words)

    assert inside("id", "-u").strip() == "1000"
    assert "PASS" in inside(*config["Entrypoint"], "run", "diff_bot_figure8", "--no-record")
    assert "usage" in inside(*config["Entrypoint"], *config["Cmd"], "--help").lower()


def services() -> dict[str, Any]:
    services: dict[str, Any] = yaml.safe_load((PACKAGING / "compose.yaml").read_text("utf-8"))["services"]
    return services


@pytest.mark.parametrize("name", ["router", "run", "page"])
def test_compose_says_commands_that_there_are(name: str) -> None:
    """With `--help` behind them, which no unknown option survives."""
    command = services()[name]["command"]
    assert "Usage" in run(sys.executable, "-m", "twin.cli", *command, "--help")
    assert services()[name]["network_mode"] == "host"


@pytest.mark.long
def test_what_compose_starts_meets(tmp_path: Path) -> None:
    """The commands as they are, without containers, and at ports that are free."""
    endpoint, page = free_endpoint(), free_endpoint()
    folder = services()["run"]["volumes"][0].partition(":")[2]

    def command(name: str, *more: str) -> list[str]:
        words = [str(word) for word in services()[name]["command"]]
        words = [word.replace("tcp/127.0.0.1:7447", endpoint) for word in words]
        return [
            sys.executable,
            "-m",
            "twin.cli",
            *(word.replace(folder, str(tmp_path)) for word in words),
            *more,
        ]

    with ExitStack() as stack:

        def start(name: str, *more: str) -> None:
            process = subprocess.Popen(
                command(name, *more), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            stack.callback(process.wait, 100)
            stack.callback(process.terminate)

        start("router", "--listen", endpoint)
        wait_for_listener(endpoint)
        start("run")
        start("page", "--port", page.rpartition(":")[2])
        wait_for_listener(page)
        address = page.removeprefix("tcp/")
        with urllib.request.urlopen(f"http://{address}/", timeout=60.0) as answer:
            assert b"<html" in answer.read()
        with connect(f"ws://{address}", max_size=None) as client:
            client.send(json.dumps({"op": "subscribe", "topic": "/odom"}))
            heard = json.loads(client.recv(timeout=100.0))
        assert heard["topic"] == "/odom"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze to ask")
def test_the_unit_is_one_that_systemd_takes(tmp_path: Path) -> None:
    text = (PACKAGING / "twin-rosbridge.service").read_text("utf-8")
    program = tmp_path / "twin"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    unit = tmp_path / "twin-rosbridge.service"
    unit.write_text(text.replace("/usr/local/lib/twin/bin/twin", str(program)))
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True, check=False
    )
    told = [line for line in done.stderr.splitlines() if "twin-rosbridge" in line]
    assert told == []


def test_the_unit_starts_a_command_that_there_is() -> None:
    text = (PACKAGING / "twin-rosbridge.service").read_text("utf-8")
    (start,) = [line for line in text.splitlines() if line.startswith("ExecStart=")]
    program, *words = start.removeprefix("ExecStart=").split()
    assert program == "/usr/local/lib/twin/bin/twin"
    assert "Usage" in run(sys.executable, "-m", "twin.cli", *words, "--help")
