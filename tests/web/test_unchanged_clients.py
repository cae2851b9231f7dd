"""Clients that others have written: roslibpy's own tests, roslib 1 and 2 in node, a page in a browser.

`make oracle` installs them: TWIN_ROSLIBPY is its unpacked sdist with a virtual environment in `venv`,
TWIN_ROSLIB1 and TWIN_ROSLIB2 are folders with `node_modules/roslib` of that version.
"""

from __future__ import annotations

import contextlib
import functools
import http.server
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.sync.client import connect

from tests.processes import free_endpoint, wait_for, wait_for_listener

ROOT = Path(__file__).parents[2]
CLIENTS = Path(__file__).parent / "clients"
ROSLIBPY = (
    "tests/ros2", "tests/test_transport.py",
    *(f"tests/ros1/test_{name}.py" for name in ("core", "ros", "rosapi", "service", "tf", "topic")),
)  # fmt: skip


def folder(variable: str) -> Path:
    """The folder that a variable names, or a skip that says so."""
    if variable not in os.environ:
        pytest.skip(f"{variable} is not set; `make oracle` installs the client and sets it")
    return Path(os.environ[variable])


@contextlib.contextmanager
def running(*command: str | Path, endpoint: str) -> Iterator[None]:
    """A process of a graph, until Ctrl-C."""
    environment = {**os.environ, "TWIN_CONNECT": endpoint}
    with subprocess.Popen([sys.executable, *command], env=environment, stdout=subprocess.DEVNULL) as process:
        try:
            yield
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60.0)


@contextlib.contextmanager
def graph(port: int, audit: Path) -> Iterator[str]:
    """A router, turtlesim, the Fibonacci server and a bridge; yields the bridge's address."""
    endpoint = free_endpoint()
    with contextlib.ExitStack() as stack:
        stack.enter_context(running("-m", "twin.cli", "router", "--listen", endpoint, endpoint=endpoint))
        wait_for_listener(endpoint)
        for example in ("turtlesim.py", "fibonacci_action_server.py"):
            stack.enter_context(running(ROOT / "examples" / example, endpoint=endpoint))
        words = ("rosbridge", "--port", str(port), "--audit", str(audit))
        stack.enter_context(running("-m", "twin.cli", *words, endpoint=endpoint))
        wait_for_listener(f"tcp/127.0.0.1:{port}")
        yield f"ws://127.0.0.1:{port}"


@pytest.mark.long
@pytest.mark.parametrize("transport", ["twisted", "asyncio"])
def test_roslibpys_own_tests(transport: str, tmp_path: Path) -> None:
    """Those for ROS 2, and of those for ROS 1 what ROS 2 has: no parameters without a node, no actionlib."""
    home = folder("TWIN_ROSLIBPY")
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", 9090)) == 0:
            pytest.skip("somebody else listens on port 9090, which roslibpy's tests name")
    with graph(9090, tmp_path / "audit.jsonl"):
        done = subprocess.run(
            [home / "venv/bin/python", "-m", "pytest", "-q", *ROSLIBPY],
            cwd=home,
            env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
            | {"ROSLIBPY_TRANSPORT": transport},
            capture_output=True,
            text=True,
            check=False,
            timeout=250.0,
        )
    assert done.returncode == 0, done.stdout
    passed = int(re.search(r"(\d+) passed", done.stdout)[1])  # type: ignore[index]
    assert passed >= 25, done.stdout


def port() -> int:
    return int(free_endpoint().rpartition(":")[2])


@pytest.mark.long
@pytest.mark.parametrize(
    ("variable", "script"), [("TWIN_ROSLIB1", "roslib1.cjs"), ("TWIN_ROSLIB2", "roslib2.mjs")]
)
def test_roslib(variable: str, script: str, tmp_path: Path) -> None:
    home, node = folder(variable), shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    shutil.copy(CLIENTS / script, tmp_path)
    (tmp_path / "node_modules").symlink_to(home / "node_modules")
    with graph(port(), tmp_path / "audit.jsonl") as address:
        done = subprocess.run(
            [node, tmp_path / script, address], capture_output=True, text=True, check=False, timeout=100.0
        )
    assert done.returncode == 0, done.stdout + done.stderr
    told = dict(json.loads(line) for line in done.stdout.splitlines() if line.startswith("["))
    if script == "roslib1.cjs":
        assert told.keys() == {"pose", "topics", "service"}
    else:
        assert told == {
            "none": True, "png": True, "cbor": True, "cbor-raw": 24, "topics": True, "nodes": True,
            "message_details": 2, "service": True, "offered": "on", "action": [True, "number"], "param": 69,
            "tf": 0.75,
        }  # fmt: skip


@contextlib.contextmanager
def browser(chromium: str, url: str, profile: Path) -> Iterator[Callable[[str], str]]:
    """Open a page; yields what evaluates JavaScript in it."""
    words = ("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0")
    command, quiet = [chromium, *words, f"--user-data-dir={profile}", url], subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet) as process:
        try:
            ports = profile / "DevToolsActivePort"
            wait_for(lambda: ports.is_file() and ports.read_text().count("\n"))
            port = ports.read_text().split()[0]

            def pages() -> list[str]:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=60.0) as answer:
                    return [page["webSocketDebuggerUrl"] for page in json.load(answer) if page["url"] == url]

            wait_for(pages)
            with connect(pages()[0]) as devtools:

                def evaluate(code: str) -> str:
                    question = {"id": 1, "method": "Runtime.evaluate", "params": {"expression": code}}
                    devtools.send(json.dumps(question))
                    while (answer := json.loads(devtools.recv(timeout=60.0))).get("id") != 1:
                        pass
                    return str(answer["result"]["result"].get("value", ""))

                yield evaluate
        finally:
            process.terminate()


@pytest.mark.long
def test_a_page_shows_where_the_turtle_is(tmp_path: Path) -> None:
    home, chromium = folder("TWIN_ROSLIB1"), shutil.which("chromium")
    if chromium is None:
        pytest.skip("chromium is not installed")
    shutil.copy(home / "node_modules/roslib/build/roslib.min.js", tmp_path)
    serve = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(tmp_path))
    bridge = port()
    page = (CLIENTS / "turtle_monitor.html").read_text("utf-8").replace("PORT", str(bridge))
    (tmp_path / "turtle_monitor.html").write_text(page)
    with (
        http.server.ThreadingHTTPServer(("127.0.0.1", 0), serve) as server,
        graph(bridge, tmp_path / "audit"),
    ):
        threading.Thread(target=server.serve_forever, daemon=True).start()
        url = f"http://127.0.0.1:{server.server_address[1]}/turtle_monitor.html"
        with browser(chromium, url, tmp_path / "profile") as evaluate:
            wait_for(lambda: "5.544" in evaluate("document.body.innerText"), 60.0)
            assert "x: 5.544 y: 5.544 theta: 0.000" in evaluate("document.body.innerText")
            assert "connected" in evaluate("document.getElementById('status').textContent")
        server.shutdown()
