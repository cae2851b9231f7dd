"""A node in another process takes part in a deterministic run: one digest, whoever runs it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from twin import runtime
from twin.runtime import Outside
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Verdict

ROOT = Path(__file__).parents[2]
NODES = Path(__file__).with_name("lockstep_nodes.py")
DRIVE = """
name: stepped
seed: 3
duration: 2 s
robots: [{model: diff_bot}]
checks: [{driven_distance: {min: 0.05 m}}]
"""
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def start(endpoint: str) -> Iterator[Start]:
    """Return a function that starts `twin exec` on a factory of lockstep_nodes; all are ended."""
    children: list[subprocess.Popen[str]] = []

    def begin(factory: str, *, sleep_s: float = 0.0) -> subprocess.Popen[str]:
        words = ["exec", f"{NODES}:{factory}", "--lockstep", "--connect", endpoint]
        children.append(
            subprocess.Popen(
                [sys.executable, "-m", "twin.cli", *words],
                cwd=ROOT,
                env={**os.environ, "LOCKSTEP_TEST_SLEEP": str(sleep_s)},
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return children[-1]

    yield begin
    for child in children:
        child.kill()
        sys.stderr.write(child.communicate()[1])


def stepped(scenario: Scenario, endpoint: str, *names: str, timeout_s: float = 30.0) -> Verdict:
    outside = Outside(wait_for=names, wait_timeout_s=timeout_s)
    return runtime.run(scenario, record=False, listen=[endpoint], outside=outside)


def in_process(scenario: Scenario, *factories: str) -> Verdict:
    outside = Outside(nodes=tuple(f"{NODES}:{factory}" for factory in factories))
    return runtime.run(scenario, record=False, outside=outside)


def test_a_node_gives_the_same_digest_in_another_process(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "controller")
    assert expected.clock == "inproc"
    for _ in range(3):
        child = start("controller", sleep_s=0.004)
        verdict = stepped(what, endpoint, "/controller")
        assert verdict.digest == expected.digest
        assert (verdict.verdict, verdict.clock, verdict.deterministic) == ("pass", "lockstep", True)
        assert child.wait(20) == 0, "the end of the run ends the process"
    assert runtime.run(what, record=False).digest != expected.digest, "the node makes a difference"


def test_services_and_actions_between_two_processes(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "server", "client")
    assert expected.verdict == "pass", "the feedback drives the robot"
    for order in (("client", "server"), ("server", "client")):
        for factory in order:  # who comes first does not matter
            start(factory, sleep_s=0.002)
        assert stepped(what, endpoint, "/server", "/client").digest == expected.digest


def test_the_names_of_two_nodes_of_one_process_step_it_once(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "server", "client")
    start("server")
    start("client")
    assert stepped(what, endpoint, "/listener", "/server", "/client").digest == expected.digest
