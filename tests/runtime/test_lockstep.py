"""A node in another process takes part in a deterministic run: one digest, whoever runs it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.savings import OFF
from twin import runtime
from twin.bridge.lockstep import stepper
from twin.errors import BridgeError, ScenarioError, TwinError
from twin.savings import ALL
from twin.scenario.outside import Outside
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
NAVIGATE = """
name: navigated
seed: 3
duration: 8 s
world: {arena: warehouse}
robots:
  - model: warehouse_bot
    start: start
    localisation: {type: amcl, map: warehouse}
    navigation: {}
checks: [{driven_distance: {min: 0.3 m}}]
"""
Start = Callable[..., subprocess.Popen[str]]


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
        child.wait()
        if child.stderr is not None and not child.stderr.closed:
            sys.stderr.write(child.communicate()[1])


@pytest.fixture
def answer(endpoint: str) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Return a function that starts a program of Zenoh and struct alone; it is ended."""
    children: list[subprocess.Popen[bytes]] = []

    def begin(*, sleep_s: float = 0.0, silent_after: int = 0) -> subprocess.Popen[bytes]:
        peer = Path(__file__).with_name("answering_peer.py")
        words = [sys.executable, str(peer), endpoint, str(sleep_s), str(silent_after)]
        children.append(subprocess.Popen(words, stdout=subprocess.PIPE))
        assert children[-1].stdout is not None
        assert children[-1].stdout.readline() == b"ready\n"
        return children[-1]

    yield begin
    for child in children:
        child.kill()
        child.communicate()


def stepped(
    scenario: Scenario, endpoint: str, *names: str, timeout_s: float = 60.0, **options: Any
) -> Verdict:
    outside = Outside(wait_for=names, wait_timeout_s=timeout_s)
    return runtime.run(scenario, record=False, listen=[endpoint], outside=outside, **options)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nodes that do come take longer to join than the run's time limit."""
    sessions = stepper._session_of

    def session_of(attendance: stepper.Attendance, name: str, timeout_s: float) -> str:
        return sessions(attendance, name, 60.0 if name == "/controller" else timeout_s)

    monkeypatch.setattr(stepper, "_session_of", session_of)


def in_process(scenario: Scenario, *factories: str) -> Verdict:
    outside = Outside(nodes=tuple(f"{NODES}:{factory}" for factory in factories))
    return runtime.run(scenario, record=False, outside=outside)


def test_a_node_gives_the_same_digest_in_another_process(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "controller")
    assert expected.clock == "inproc"
    for savings in (ALL, OFF):
        child = start("controller", sleep_s=0.004)
        verdict = stepped(what, endpoint, "/controller", savings=savings)
        assert verdict.digest == expected.digest
        assert (verdict.verdict, verdict.clock, verdict.deterministic) == ("pass", "lockstep", True)
        assert child.wait(100) == 0, "the end of the run ends the process"
    assert runtime.run(what, record=False).digest != expected.digest, "the node makes a difference"


def test_faults_of_the_network_are_the_same_between_processes(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    late = "{link_delay: {time: 50 ms, jitter: 20 ms, topic: /odom, at: 0.5 s}}"
    what = scenario(
        f"{DRIVE}faults: [{{loss: 30 %}}, {late}, {{duplication: {{share: 0.5, topic: /cmd_vel}}}}]\n"
    )
    expected = in_process(what, "controller")
    assert [fault.outcome for fault in expected.faults] == ["landed"] * 3
    start("controller")
    verdict = stepped(what, endpoint, "/controller")
    assert verdict.digest == expected.digest
    assert verdict.faults == expected.faults


@pytest.mark.slow
def test_ten_of_ten_runs_with_a_slow_controller_have_one_digest(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE.replace("2 s", "0.5 s").replace("0.05 m", "0.01 m"))
    expected = in_process(what, "controller").digest
    digests = []
    for _ in range(10):
        start("controller", sleep_s=0.06)
        digests.append(stepped(what, endpoint, "/controller").digest)
    assert digests == [expected] * 10


def test_services_and_actions_between_two_processes(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "server", "client")
    assert expected.verdict == "pass", "the feedback drives the robot"
    for order, savings in ((("client", "server"), ALL), (("server", "client"), OFF)):
        for factory in order:  # who comes first does not matter
            start(factory, sleep_s=0.002)
        verdict = stepped(what, endpoint, "/server", "/client", savings=savings)
        assert verdict.digest == expected.digest


def test_the_names_of_two_nodes_of_one_process_step_it_once(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "server", "client")
    start("server")
    start("client")
    assert stepped(what, endpoint, "/listener", "/server", "/client").digest == expected.digest


def test_a_program_that_answers_on_a_topic_gives_the_digest_of_a_node(
    scenario: Callable[[str], Scenario], endpoint: str, answer: Callable[..., subprocess.Popen[bytes]]
) -> None:
    what = scenario(DRIVE)
    expected = in_process(what, "answering")
    for name in ("/cmd_vel", "/cmd_vel@/odom"):
        program = answer(sleep_s=0.004)
        verdict = stepped(what, endpoint, name)
        program.kill()  # else it would join the next run too
        program.wait()
        assert verdict.digest == expected.digest
        assert (verdict.clock, verdict.deterministic) == ("lockstep", True)


def test_a_topic_without_an_answer_is_named(
    scenario: Callable[[str], Scenario], endpoint: str, answer: Callable[..., subprocess.Popen[bytes]]
) -> None:
    answer(silent_after=10)
    with pytest.raises(BridgeError, match=r"/cmd_vel had no answer to /odom in tick \d+ .*within 2 s"):
        stepped(scenario(DRIVE), endpoint, "/cmd_vel", timeout_s=2.0)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP, signal.SIGINT])
def test_a_node_that_fails_ends_the_run_with_its_name(
    number: signal.Signals, scenario: Callable[[str], Scenario], endpoint: str, start: Start, patient: None
) -> None:
    child = start("controller", sleep_s=0.02)
    ticks = []

    def fail_later(progress: runtime.Progress) -> None:
        ticks.append(progress.time_s)
        child.send_signal(number)

    problem = "did not answer tick" if number == signal.SIGSTOP else "left the run without an answer to tick"
    with pytest.raises(BridgeError, match=rf"the node /controller {problem} \d+ \(t = .* s\)"):
        runtime.run(
            scenario(DRIVE),
            record=False,
            listen=[endpoint],
            outside=Outside(wait_for=("/controller",), wait_timeout_s=2.0),
            progress=fail_later,
        )
    assert ticks, "the run had begun"
    if number == signal.SIGINT:
        assert (child.wait(100), child.communicate()[1]) == (130, "")


def test_an_exception_in_the_node_is_seen_on_both_sides(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    child = start("broken")
    with pytest.raises(BridgeError, match="/controller left the run without an answer to tick 25"):
        stepped(scenario(DRIVE), endpoint, "/controller")
    assert "ZeroDivisionError" in child.communicate()[1]
    assert child.returncode == 2


def test_nobody_comes(scenario: Callable[[str], Scenario], endpoint: str) -> None:
    with pytest.raises(BridgeError, match=r"no node /controller has joined within 0\.2 s"):
        stepped(scenario(DRIVE), endpoint, "/controller", timeout_s=0.2)
    with pytest.raises(BridgeError, match=r"nobody has joined who hears /odom and publishes /cmd_vel"):
        stepped(scenario(DRIVE), endpoint, "/cmd_vel", timeout_s=0.2)
    with pytest.raises(BridgeError, match=r"no node of the run publishes /nothing"):
        stepped(scenario(DRIVE), endpoint, "/cmd_vel@/nothing", timeout_s=0.2)


def test_a_misspelt_node_is_told_beside_what_has_joined(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start, patient: None
) -> None:
    start("controller")
    problem = r"no node /controler has joined within 0\.2 s; .*; what has joined: /controller$"
    with pytest.raises(BridgeError, match=problem):
        stepped(scenario(DRIVE), endpoint, "/controller", "/controler", timeout_s=0.2)


def test_who_only_watches_changes_nothing(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    """A stranger listens, asks, commands the robot and sets parameters: it only gets answers."""
    what = scenario(DRIVE)
    expected = in_process(what, "controller")
    child = start("controller", sleep_s=0.02)
    stranger = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("stranger.py")), endpoint],
        stdout=subprocess.PIPE,
        text=True,
    )
    listens = stranger.stdout
    assert listens is not None
    said: list[str] = []

    def until_it_listens(_: runtime.Progress) -> None:
        if not said:
            said.append(listens.readline())

    try:
        verdict = stepped(what, endpoint, "/controller", progress=until_it_listens)
        heard = json.loads(stranger.communicate(timeout=120)[0])
    finally:
        stranger.kill()
        stranger.wait()
    assert verdict.digest == expected.digest
    assert verdict.deterministic
    assert heard["odom"] > 0
    assert heard["commands"] > 0, "also what the process in lock-step publishes"
    assert heard["nodes"].count("/controller") == 1
    assert heard["parameters"] is True
    assert heard["set"] is False
    assert child.wait(100) == 0


@pytest.mark.slow
def test_a_navigation_goal_from_another_process(
    scenario: Callable[[str], Scenario], endpoint: str, start: Start
) -> None:
    what = scenario(NAVIGATE)
    expected = in_process(what, "navigator")
    start("navigator")
    verdict = stepped(what, endpoint, "/navigator")
    assert verdict.verdict == "pass", "the robot has driven"
    assert verdict.digest == expected.digest


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("nowhere.py:make", r"nowhere\.py: node 'nowhere\.py:make': there is no such file"),
        (
            f"{NODES}:contoller",
            r"lockstep_nodes\.py: .* there is no 'contoller' in it; did you mean 'contr",
        ),
        (f"{NODES}:faulty", r"lockstep_nodes\.py:\d+: .*:faulty' fails: KeyError: 'gain'"),
        (f"{NODES}:late", r"lockstep_nodes\.py:\d+: .*:late' fails: KeyError: 'too late'"),
        (f"{NODES}:delay", r"lockstep_nodes\.py:\d+: .* TypeError: delay\(\) takes 0 positional arguments"),
        ("controller", r"controller names no nodes; valid: FILE\.py:FUNCTION"),
    ],
)
def test_what_is_wrong_with_the_users_nodes(
    place: str, message: str, scenario: Callable[[str], Scenario]
) -> None:
    with pytest.raises(TwinError, match=message):
        runtime.run(scenario(DRIVE), record=False, outside=Outside(nodes=(place,)))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"free": True, "wait_for": ("/a",)}, "a run waits for others or does not"),
        ({"wait_for": ("controller",)}, r"--wait-for controller: must be a node such as /controller"),
        ({"wait_for": ("/cmd_vel@scan",)}, r"--wait-for /cmd_vel@scan: must be"),
        ({"wait_for": ("/a",), "wait_timeout_s": 0.0}, "must be more than 0 s"),
    ],
)
def test_options_that_contradict(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        Outside(**options)
