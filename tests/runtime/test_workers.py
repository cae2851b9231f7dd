"""Workers run the nodes of robots: the run is the same whoever does, and ends in a sentence if one dies."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from twin.errors import ScenarioError, SimulationError
from twin.runtime.open_run import OpenRun, run
from twin.scenario.outside import Outside
from twin.scenario.schema import Scenario

MakeScenario = Callable[[str], Scenario]
TRIO = """
name: trio
duration: 1.6 s
seed: 3
robots:
  - {model: diff_bot, name: a, pose: {y: 2}, localisation: {type: odometry}}
  - {model: diff_bot, name: b, pose: {y: 0}, localisation: {type: odometry}}
  - {model: diff_bot, name: c, pose: {y: -2}, localisation: {type: odometry}}
missions:
  - {type: behaviors, robot: a, steps: [{drive_on_heading: {distance: 0.2}}, {spin: {angle: 1.0}}]}
  - {type: "crossing.py:Crossing", robot: b}
faults:
  - odometry_jump: {robot: a, at: 0.5 s, distance: 0.3 m}
checks:
  - localisation_error: {robot: a, max: 50 cm}
  - driven_distance: {robot: b, min: 0.05}
  - driven_distance: {robot: c, min: 0.05}
"""
CROSSING = '''
"""Node groups that do talk to each other."""

from twin.bridge.action_types import BackUp
from twin.bridge.actions import ActionClient
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Odometry, Point, String, duration, new
from twin.bridge.msgs import Twist
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import GetParameters, Trigger
from twin.nodes.missions.mission_node import MissionNode


def boss(bus):
    """The user's own nodes: they hear, ask and command robots, and robots ask them."""
    node = bus.create_node("boss")
    heard = node.create_publisher(String, "heard", 10)
    commands = node.create_publisher(Twist, "/c/cmd_vel", 10)
    asked = node.create_client(GetParameters, "/a/diff_drive_controller/get_parameters")
    back = ActionClient(node, BackUp, "/a/backup")
    counts = {"odom": 0, "asked": 0}

    def on_odom(message):
        counts["odom"] += 1
        if counts["odom"] == 10:
            future = asked.call_async(new(GetParameters.Request, names=["use_sim_time"]))
            future.add_done_callback(lambda f: f.error or heard.publish(String(repr(f.result.values[0]))))
        if counts["odom"] == 30:
            limit = duration(9_000_000_000)
            back.send_goal(new(BackUp.Goal, target=Point(0.1, 0.0, 0.0), speed=0.1, time_allowance=limit))
        heard.publish(String(f"{message.header.stamp.nanosec} {message.pose.pose.position.x!r}"))
        commands.publish(twist_from_planar(0.1, 0.0))

    def on_ask(request):
        counts["asked"] += 1
        return Trigger.Response(success=counts["asked"] > 3, message=str(counts["odom"]))

    node.create_subscription(Odometry, "/a/odom", on_odom, 10)
    node.create_service(Trigger, "permission", on_ask)
    return [node]


class Crossing(MissionNode):
    """Asks the boss and robot c, hears what robot a is at, and drives."""

    def __init__(self, context, config):
        super().__init__(context.bus, namespace=context.namespace)
        self.log = self.node.create_publisher(String, "log", 10)
        self.commands = self.node.create_publisher(Twist, "cmd_vel", 10)
        self.permission = self.node.create_client(Trigger, "/permission")
        self.parameters = self.node.create_client(GetParameters, "/c/diff_drive_controller/get_parameters")
        self.node.create_subscription(String, "/a/mission/state", self.on_state, LATCHED)
        self.node.create_timer(200_000_000, self.tick)
        self.may = False

    def on_state(self, message):
        self.log.publish(String("a: " + message.data))

    def tick(self):
        self.permission.call_async(Trigger.Request()).add_done_callback(self.on_answer)
        future = self.parameters.call_async(new(GetParameters.Request, names=["wheel_radius"]))
        future.add_done_callback(lambda f: f.error or self.log.publish(String(repr(f.result))))
        if self.may:
            self.commands.publish(twist_from_planar(0.2, 0.0))

    def on_answer(self, future):
        if future.error is not None:
            return
        self.may = future.result.success
        self.node.get_logger().info(future.result.message)
'''


@pytest.fixture
def trio(tmp_path: Path, scenario: MakeScenario) -> Scenario:
    """Three robots and a user's node, all of which talk to each other."""
    (tmp_path / "crossing.py").write_text(CROSSING, encoding="utf-8")
    return scenario(TRIO)


def boss(tmp_path: Path) -> Outside:
    return Outside(nodes=(f"{tmp_path / 'crossing.py'}:boss",))


def test_any_number_of_workers_gives_the_same_run(trio: Scenario, tmp_path: Path) -> None:
    alone, *others = (run(trio, record=False, outside=boss(tmp_path), workers=n) for n in (0, 1, 3))
    assert alone.verdict == "pass", [check.reason for check in alone.checks]
    for verdict in others:
        assert verdict.checks == alone.checks
        assert verdict.digest == alone.digest


def test_a_worker_runs_the_nodes_of_its_robots_and_nobody_else_does(trio: Scenario, tmp_path: Path) -> None:
    opened = OpenRun(trio, record=False, outside=boss(tmp_path), workers=2)
    try:
        opened.advance(lambda: opened.run.world.time_ns >= 500_000_000)
        timers = {node.fully_qualified_name: node.due_ns for node in opened.run.bus.nodes if node.due_ns}
        assert not [name for name in timers if name.startswith(("/b/", "/c/"))]
        assert [name for name in timers if name.startswith("/a/")], "whose hardware fails here, it stays"
        assert opened.run.workers is not None
        assert opened.run.workers.cpu_s > 0.0
    finally:
        opened.close()


def test_a_recording_and_a_bag_are_those_of_a_run_without(trio: Scenario, tmp_path: Path) -> None:
    digests = {
        run(trio, out=tmp_path / str(n), bag=tmp_path / f"bag{n}", outside=boss(tmp_path), workers=n).digest
        for n in (0, 2)
    }
    assert len(digests) == 1
    bags = [next((tmp_path / f"bag{n}").glob("*.mcap")).read_bytes() for n in (0, 2)]
    assert len(bags[0]) == len(bags[1]) > 10_000


def test_a_node_that_fails_in_a_worker_ends_the_run_with_its_own_error(
    tmp_path: Path, scenario: MakeScenario
) -> None:
    text = CROSSING.replace("self.may = future", "self.may = 1 / len(future.result.message[2:]) and future")
    (tmp_path / "crossing.py").write_text(text, encoding="utf-8")
    told = set()
    for workers in (0, 2):
        with pytest.raises(Exception, match="division by zero") as caught:
            run(scenario(TRIO), record=False, outside=boss(tmp_path), workers=workers)
        told.add((caught.type, str(caught.value)))
    assert len(told) == 1


def _half_way(scenario: Scenario) -> tuple[OpenRun, list[int]]:
    opened = OpenRun(scenario, record=False, workers=2)
    opened.advance(lambda: opened.run.world.time_ns >= 200_000_000)
    assert opened.run.workers is not None
    return opened, opened.run.workers.pids


def _all_have_ended(pids: list[int]) -> bool:
    for pid in pids:
        with pytest.raises(ChildProcessError):
            os.waitpid(pid, os.WNOHANG)
    return bool(pids)


def test_a_worker_that_dies_ends_the_run_in_one_sentence(trio: Scenario) -> None:
    opened, pids = _half_way(trio)
    try:
        os.kill(pids[1], signal.SIGKILL)
        with pytest.raises(SimulationError, match=r"^worker 1 \(c\) has ended by SIGKILL at t = 0\.2\d\d s"):
            opened.advance()
    finally:
        opened.close()
    assert _all_have_ended(pids)


def test_ctrl_c_ends_the_workers(trio: Scenario) -> None:
    opened, pids = _half_way(trio)
    for pid in pids:
        os.kill(pid, signal.SIGINT)  # as a terminal does, to all of them: the run alone decides

    def interrupted() -> NoReturn:
        raise KeyboardInterrupt

    try:
        with pytest.raises(KeyboardInterrupt):
            opened.advance(interrupted)
    finally:
        opened.close()
    assert _all_have_ended(pids)


def test_a_run_that_others_can_join_has_none(trio: Scenario) -> None:
    with pytest.raises(ScenarioError, match="nobody else takes part in"):
        OpenRun(trio, record=False, workers=2, listen=["tcp/127.0.0.1:0"])
