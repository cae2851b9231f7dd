"""`twin run --wait-for` and `twin exec` as people start them: two processes, Ctrl-C, exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.processes import wait_for

ROOT = Path(__file__).parents[2]
NODES = ROOT / "tests" / "runtime" / "lockstep_nodes.py"
TEXT = """
name: driven
seed: 1
duration: DURATION
robots: [{model: diff_bot}]
checks: [{driven_distance: {min: 0.01 m}}]
"""
Twin = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[Twin]:
    """Return a function that starts `twin` in a folder with `driven.yaml`; all are ended."""
    children: list[subprocess.Popen[str]] = []

    def start(*words: str, duration: str = "1 s") -> subprocess.Popen[str]:
        (tmp_path / "driven.yaml").write_text(TEXT.replace("DURATION", duration), encoding="utf-8")
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        children.append(
            subprocess.Popen(
                [sys.executable, "-m", "twin.cli", *words],
                cwd=tmp_path,
                env={**os.environ, "LOCKSTEP_TEST_SIGN": str(tmp_path / "sign")},
                text=True,
                **pipes,
            )
        )
        return children[-1]

    yield start
    for child in children:
        child.kill()
        child.wait()
        for pipe in (child.stdout, child.stderr):
            assert pipe is not None
            pipe.close()


def test_one_file_in_process_and_in_lock_step(twin: Twin, endpoint: str) -> None:
    run = ("run", "driven.yaml", "--no-record", "--json", "--out")
    alone = twin(*run, "1", "--node", f"{NODES}:controller")
    node = twin("exec", f"{NODES}:controller", "--lockstep", "--connect", endpoint)
    stepped = twin(*run, "2", "--wait-for", "/controller", "--listen", endpoint, "--wait-timeout", "60")
    verdicts = [json.loads(process.communicate(timeout=120)[0]) for process in (alone, stepped)]
    assert (alone.returncode, stepped.returncode, node.wait(100)) == (0, 0, 0)
    assert verdicts[0]["digest"] == verdicts[1]["digest"] is not None
    assert [verdict["clock"] for verdict in verdicts] == ["inproc", "lockstep"]


def test_a_node_that_never_comes_is_an_error(twin: Twin, endpoint: str, tmp_path: Path) -> None:
    run = twin(
        "run",
        "driven.yaml",
        "--out",
        "o",
        "--wait-for",
        "/brain",
        "--listen",
        endpoint,
        "--wait-timeout",
        "0.1",
    )
    _, errors = run.communicate(timeout=120)
    assert run.returncode == 2
    assert errors.startswith("error: no node /brain has joined within 0.1 s; start its process")
    verdict = json.loads((tmp_path / "o" / "verdict.json").read_text(encoding="utf-8"))
    assert (verdict["verdict"], verdict["clock"], verdict["digest"]) == ("error", "lockstep", None)


def test_free_running_is_labelled(twin: Twin, endpoint: str) -> None:
    run = twin("run", "driven.yaml", "--no-record", "--out", "o", "--free", "--listen", endpoint)
    node = twin("exec", f"{NODES}:controller", "--connect", endpoint, "--use-sim-time")
    table, _ = run.communicate(timeout=120)
    assert "clock free" in table
    assert "not deterministic" in table
    assert node.poll() in (None, 2), "2: the run was over before the node came"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("who", "number", "codes"),
    [
        ("run", signal.SIGINT, (130, 0)),
        ("run", signal.SIGKILL, (-signal.SIGKILL, 0)),
        ("node", signal.SIGINT, (2, 130)),
    ],
)
def test_one_ends_the_other(
    who: str, number: signal.Signals, codes: tuple[int, int], twin: Twin, endpoint: str, tmp_path: Path
) -> None:
    words = ("--wait-for", "/controller", "--listen", endpoint, "--pace", "1", "--wait-timeout", "60")
    node = twin("exec", f"{NODES}:controller", "--lockstep", "--connect", endpoint)
    run = twin("run", "driven.yaml", "--no-record", "--out", "o", *words, duration="60 s")
    wait_for((tmp_path / "sign").exists, 60.0)
    (run if who == "run" else node).send_signal(number)
    errors = run.communicate(timeout=120)[1] + node.communicate(timeout=120)[1]
    assert "Traceback" not in errors
    assert (run.returncode, node.returncode) == codes, errors
