"""A graph in another process, and commands that talk to it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.processes import free_endpoint

GRAPH = Path(__file__).with_name("some_graph.py")
ROOT = Path(__file__).parents[3]

Twin = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def endpoint(request: pytest.FixtureRequest) -> Iterator[str]:
    """A process with some nodes (some_graph.py, or what the module names as GRAPH), and where it listens."""
    graph = GRAPH.with_name(getattr(request.module, "GRAPH", GRAPH.name))
    address = free_endpoint()
    with subprocess.Popen(
        [sys.executable, str(graph), address],
        stdout=subprocess.PIPE,
        stdin=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield address
        process.communicate()  # closes its input: it ends
    assert process.returncode == 0


@pytest.fixture
def twin(endpoint: str) -> Twin:
    """Run `twin …` in a process of its own, connected to the graph."""

    def run(*arguments: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "twin.cli", *arguments, "--connect", endpoint]
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)

    return run


@pytest.fixture
def twin_here(endpoint: str, invoke: Callable[..., tuple[int, str, str]]) -> Twin:
    """Run `twin …` in this process, connected to the graph: as `twin`, and several times as fast."""

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(arguments, *invoke(*arguments, "--connect", endpoint))

    return run
