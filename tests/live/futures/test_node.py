"""`/futures`: a run that others ask."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Invoke
from tests.live.futures.conftest import CHECKS, SCENARIO, Begin, digest, go_on
from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Path as PathMsg
from twin.bridge.msgs import Twist, new
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Trigger
from twin.live.futures.futures import Answer
from twin.live.futures.names import RUN, SNAPSHOT
from twin.live.futures.node import FuturesNode, parameters_of
from twin.live.futures.what_if import WhatIf
from twin.runtime.open_run import OpenRun


def asked(run: OpenRun, service: str = RUN) -> Any:
    """Ask by a service, and go on until the answer is there."""
    client = run.run.bus.create_node("asker").create_client(Trigger, service)
    future = client.call_async(Trigger.Request())
    run.advance(lambda: future.done)
    client.node.destroy()
    return future.result


def test_it_answers_while_the_run_goes_on(begin: Begin) -> None:
    alone = begin(0.0, duration="10000 s", drive="9000 s")
    run = begin(0.0, duration="10000 s", drive="9000 s")
    node = FuturesNode(run).node
    go_on(run, 1.0)
    for name, value in parameters_of(WhatIf(n=2, horizon=1.0, set=("friction=0.9",))).items():
        node.set_parameter(name, value)
    response = asked(run)
    assert response.success, response.message
    told = Answer.from_json(response.message)
    assert told.asked == WhatIf(n=2, horizon=1.0, set=("friction=0.9",))
    assert [one.end_s for one in told.outcomes] == [1.0, 1.0]
    assert run.run.world.time_ns * 1e-9 > told.at_s
    go_on(alone, run.run.world.time_ns * 1e-9)
    assert digest(run) == digest(alone), "that somebody asks is no part of the run"


def test_their_paths_are_in_the_recording(begin: Begin, tmp_path: Path) -> None:
    from twin.recording.read_back import read

    scenario = begin(0.0, duration="10000 s", drive="9000 s").run.scenario
    run = OpenRun(scenario, out=tmp_path / "out")
    try:
        node = FuturesNode(run).node
        node.set_parameter("n", 2)
        node.set_parameter("horizon", 0.2)
        assert asked(run).success
        run.finish()
    finally:
        run.close()
    entities = read(tmp_path / "out" / "there_and_back.rrd").entities
    assert {"/ros/futures/path_1", "/ros/futures/path_2"} <= set(entities)


def test_it_refuses_in_a_sentence(begin: Begin) -> None:
    run = begin(0.0, duration="10000 s", drive="9000 s")
    node = FuturesNode(run).node
    for name, value, why in (
        ("goal", "1,2", "--goal 1,2: must be x,y,yaw"),
        ("goal", "1,2,0", "--goal: robot 'diff_bot' does not navigate"),
        ("n", 0, "--n 0: must be from 1 to 1000"),
        ("set", ["frictio=1"], "--set frictio=1: there is no 'frictio'"),
    ):
        before = node.get_parameter(name).value
        node.set_parameter(name, value)
        response = asked(run)
        assert not response.success
        assert why in response.message
        node.set_parameter(name, before)
    assert "--keep-inputs" in asked(run, SNAPSHOT).message


def test_one_question_at_a_time_and_none_is_left_open(begin: Begin) -> None:
    run = begin(0.0, duration="10000 s", drive="9000 s")
    FuturesNode(run)
    client = run.run.bus.create_node("asker").create_client(Trigger, RUN)
    first, second = (client.call_async(Trigger.Request()) for _ in range(2))
    run.advance(lambda: second.done)
    assert "ask again" in second.result.message
    assert not first.done
    run.close()
    assert first.done, "its client learns that the run has gone"


@pytest.fixture
def twin_run(tmp_path: Path, endpoint: str) -> Any:
    """A run in real time, in another process."""
    (tmp_path / "it.yaml").write_text(SCENARIO.format(duration="600 s", checks=CHECKS, drive="500 s"))
    words = [
        "run",
        "it.yaml",
        "--pace",
        "1",
        "--listen",
        endpoint,
        "--keep-inputs",
        "--no-record",
        "--out",
        "out",
    ]
    process = subprocess.Popen([sys.executable, "-m", "twin.cli", *words], cwd=tmp_path)
    yield endpoint
    process.kill()
    process.wait()


def test_from_another_terminal(twin_run: str, tmp_path: Path, invoke: Invoke) -> None:
    fork = ["fork", "--connect", twin_run]
    ghosts: list[Any] = []
    with live.join((twin_run,), timeout_s=100.0) as here:
        node = here.bus.create_node("someone")
        commands = node.create_publisher(Twist, "/cmd_vel", 10)
        for number in (1, 2):
            node.create_subscription(PathMsg, f"/futures/path_{number}", ghosts.append, LATCHED)
        assert here.spin(lambda: commands.has_subscribers, timeout_s=100.0)
        commands.publish(new(Twist))
        code, out, err = invoke(*fork, "--n", "2", "--horizon", "1", "--json")
        assert code == 0, err
        told = json.loads(out)
        assert [one["end"] for one in told["outcomes"]] == ["under way", "under way"]
        assert told["awaited"] == "the end of the mission"
        assert here.spin(lambda: len(ghosts) >= 2, timeout_s=100.0)
        assert {len(ghost.poses) for ghost in ghosts} == {11}
    code, _, err = invoke(*fork, "--goal", "1,2,3")
    assert (code, err) == (2, "error: --goal: robot 'diff_bot' does not navigate; it has no `navigation`\n")
    snapshot = tmp_path / "now.json"
    code, out, err = invoke(*fork, "--save", snapshot)
    assert code == 0, err
    assert "to be there again" in out
    code, out, err = invoke("fork", "--at", snapshot, "--n", "1", "--horizon", "1")
    assert code == 0, err
    assert "0 of 1 reach the end of the mission within 1 s" in out


def test_who_is_no_run(endpoint: str, invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("twin.cli.live.fork._WAIT_S", 0.2)
    with Bus.open(Clock(), listen=(endpoint,)):
        code, _, err = invoke("fork", "--connect", endpoint)
    assert (code, err.partition(";")[0]) == (2, "error: nobody there tells futures")
