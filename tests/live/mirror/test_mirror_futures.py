"""Futures of mirrors: they go on with the virtual robot's sensors, and nobody else notices them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from tests.live.futures.conftest import listening
from tests.live.mirror.beside import Beside
from twin.bridge import live
from twin.bridge.msgs import Odometry, String, Twist, ns
from twin.bridge.msgs import Path as PathMsg
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Trigger
from twin.errors import SimulationError
from twin.geometry import Pose2
from twin.live.futures.names import RUN, SNAPSHOT
from twin.live.futures.node import FuturesNode
from twin.scenario.schema import Scenario, load

_START = Pose2(-8.5, -5.4, 0.0)
_GOAL = Pose2(-5.0, -3.0, 1.0)
_NAVIGATES = """
name: navigates
seed: 1
duration: 9000 s
world: {{arena: warehouse}}
robots:
  - model: {model}
    pose: {{x: {pose.x}, y: {pose.y}, yaw: {pose.yaw}}}
    localisation: {{type: amcl, map: warehouse}}
    odometry: {{type: {odometry}}}
    navigation: {{}}
mission:
  type: behaviors
  robot: {model}
  steps: [{{navigate_to_pose: {{x: -5 m, y: -3 m, yaw: 1 rad}}}}, {{wait: {{duration: 8000 s}}}}]
checks: [{{no_collision: }}]
"""


def beside(folder: Path, model: str = "diff_bot", odometry: str = "wheels", **options: Any) -> Beside:
    def scenario(pose: Pose2) -> Scenario:
        file = folder / "navigates.yaml"
        file.write_text(_NAVIGATES.format(model=model, odometry=odometry, pose=pose), encoding="utf-8")
        return load(file)

    return Beside(scenario, _START, **{"autonomy": "all", **options})


def ask(both: Beside, service: str) -> Any:
    """Ask by a service, and go on until the answer is there."""
    client = both.run.run.bus.create_node("asker").create_client(Trigger, service)
    future = client.call_async(Trigger.Request())
    both.mirror.advance(lambda: future.done)
    client.node.destroy()
    return future.result


class Driven:
    """A mirror of a robot that drives to its goal, asked on the way, or not."""

    def __init__(self, folder: Path, at_s: float, asks: bool, **options: Any) -> None:
        self.at_s = at_s
        with beside(folder, **options) as both:
            (stack,) = both.run.run.parts.stacks.values()
            both.until(at_s)
            assert stack.navigator is not None
            (goal,) = stack.navigator.under_way
            (robot,), (physical,) = both.mirror.robots, both.plant.run.run.parts.stacks.values()
            assert robot.odometry is not None
            truly = physical.robot_pose.in_odom()
            assert truly is not None
            self.odometry_off = robot.odometry.inverse() @ truly
            self.answer = both.answer(n=2, horizon=20.0) if asks else None
            self.truth: dict[int, Pose2] = {}
            self.virtual: dict[int, Pose2] = {}

            def note() -> bool:
                now = round((both.now_s - at_s) * 1e3)
                self.truth[now], self.virtual[now] = both.pose(both.plant.run), both.pose(both.run)
                return not goal.is_active

            both.mirror.advance(note)
            self.arrival_s = both.now_s - at_s
            both.until(both.now_s + 1.0)
            self.digest, self.commands = both.digest, both.source.commands


@pytest.fixture(scope="module")
def asked_once(tmp_path_factory: pytest.TempPathFactory) -> Driven:
    return Driven(tmp_path_factory.mktemp("asked"), 3.0, asks=True)


def agrees(driven: Driven) -> None:
    told = driven.answer
    assert told is not None
    assert (told.label, told.awaited, told.succeeded) == ("twin", "the goal under way", 2)
    for one in told.outcomes:
        assert one.arrival_s == pytest.approx(driven.arrival_s, abs=0.5)
        for after_s, x, y, _ in one.path:
            truth = driven.truth.get(round(after_s * 1e3))
            assert truth is None or truth.distance(Pose2(x, y, 0.0)) < 0.15, "it moves up to 1 m/s"
        assert Pose2(*one.path[-1][1:]).distance(driven.truth[max(driven.truth)]) < 0.1
    assert told.outcomes[0].path[0][0] == 0.0
    assert math.hypot(driven.odometry_off.x, driven.odometry_off.y) < 0.005
    assert abs(driven.odometry_off.yaw) < 0.005


def test_what_they_tell_is_what_the_physical_robot_does(asked_once: Driven) -> None:
    agrees(asked_once)
    assert asked_once.answer is not None
    assert asked_once.arrival_s > 3.0, "it must have been on its way"


def test_commands_reach_the_virtual_robot_when_they_reach_the_physical_one(asked_once: Driven) -> None:
    steps = sorted(time for time in asked_once.truth if time > 1000)

    def apart(late_ticks: int) -> float:
        pairs = zip(steps[: len(steps) - late_ticks], steps[late_ticks:], strict=True)
        return max(abs(asked_once.truth[a].yaw - asked_once.virtual[b].yaw) for a, b in pairs)

    assert math.degrees(apart(0)) < 0.2
    assert apart(0) < apart(1), "the virtual one is not behind"


@pytest.mark.parametrize(("here", "late_ns"), [(True, 20_000_000), (False, 0)])
def test_what_the_robot_commands_itself_has_come_a_long_way_already(
    here: bool, late_ns: int, tmp_path: Path
) -> None:
    told: dict[str, list[Any]] = {"/cmd_vel": [], "/twin/cmd_vel": []}
    with beside(tmp_path) as both:
        (robot,) = both.mirror.robots
        both.until(1.0)
        if not here:
            vars(robot)["_own_commands"] = set()
        both.run.run.bus.tap(lambda sample: told.get(sample.topic, []).append(sample))
        both.until(3.0)
    relayed = {id(sample.message): sample.time_ns for sample in told["/twin/cmd_vel"]}
    said = [sample for sample in told["/cmd_vel"] if id(sample.message) in relayed]
    assert len(said) > 30
    assert {relayed[id(sample.message)] - sample.time_ns for sample in said} == {late_ns}


def test_the_mirror_says_the_same_whether_it_is_asked_or_not(asked_once: Driven, tmp_path: Path) -> None:
    alone = Driven(tmp_path, 3.0, asks=False)
    assert len(alone.commands) > 100
    assert alone.commands == asked_once.commands
    assert alone.digest == asked_once.digest


def test_a_robot_with_an_arm_whose_wheels_and_gyroscope_are_fused(tmp_path: Path) -> None:
    agrees(Driven(tmp_path, 2.5, asks=True, model="warehouse_bot", odometry="ekf"))


def test_goals_elsewhere_and_what_is_otherwise(tmp_path: Path, asked_once: Driven) -> None:
    with beside(tmp_path) as both:
        both.until(3.0)
        (there,) = both.answer(n=1, horizon=20.0, goal=(-8.0, -4.0, 0.0)).outcomes
        assert there.end == "arrived"
        assert Pose2(*there.path[-1][1:]).distance(Pose2(-8.0, -4.0, 0.0)) < 0.3
        (small,) = both.answer(n=1, horizon=20.0, set=("wheel_radius=0.6",)).outcomes
        assert small.arrival_s is not None
        assert small.arrival_s > asked_once.arrival_s + 1.0, "nothing pulls it where odometry has it"
        (slippery,) = both.answer(n=1, horizon=2.0, set=("friction=0.02",)).outcomes
        assert asked_once.answer is not None
        assert slippery.path[10] != asked_once.answer.outcomes[0].path[10]


def test_nobody_hears_them_and_the_node_answers(tmp_path: Path, endpoint: str) -> None:
    with beside(tmp_path, network=listening(endpoint), out=tmp_path / "out") as both:
        node = FuturesNode(both.run).node
        node.set_parameter("n", 2)
        node.set_parameter("horizon", 4.0)
        commands: list[Twist] = []
        ahead: list[int] = []
        paths: list[PathMsg] = []
        with live.join((endpoint,)) as here:
            observer = here.bus.create_node("observer")
            observer.create_subscription(Twist, "/cmd_vel", commands.append, 10_000)

            def on_odometry(message: Odometry) -> None:
                ahead.append(ns(message.header.stamp) - both.mirror.clock.now_ns)

            for topic in ("/odom", "/twin/odom"):
                observer.create_subscription(Odometry, topic, on_odometry, 1000)
            observer.create_subscription(PathMsg, "/futures/path_1", paths.append, LATCHED)

            state = observer.create_publisher(String, "/mission/state", LATCHED)
            arrived: list[str] = []
            both.run.run.bus.arrival_taps.append(lambda arrival: arrived.append(arrival.receiver.name))

            def listen() -> None:
                if "/mission/state" not in arrived:  # what others say is drawn, too
                    state.publish(String(data="elsewhere"))
                here.spin_once(0.0)

            both.run.between_ticks.append(listen)
            both.until(3.0)
            told = both.source.commands
            assert here.spin(lambda: bool(commands) and commands[-1] == told[-1][1], timeout_s=60.0)
            missed = len(told) - len(commands)
            before_ns = both.mirror.clock.now_ns
            response = ask(both, RUN)
            assert response.success, response.message
            assert here.spin(lambda: len(commands) + missed >= len(told) and bool(paths), timeout_s=60.0)
            both.run.between_ticks.remove(listen)
        assert "/mission/state" in arrived
        assert commands[-100:] == [message for _, message in told[-100:]]
        assert len(commands) + missed == len(told)
        assert max(ahead) <= 0
        (path,) = paths
        assert before_ns <= ns(path.header.stamp) <= both.mirror.clock.now_ns, "by the robot's clock"
        assert both.mirror.statuses()[0].judgement.label == "twin"
        assert "no snapshot" in ask(both, SNAPSHOT).message
    from twin.recording.read_back import read

    entities = read(tmp_path / "out" / "navigates.rrd").entities
    assert {"/ros/futures/path_1", "/ros/futures/path_2"} <= set(entities)


def test_where_no_physical_robot_is_heard_it_is_a_model_s_future(tmp_path: Path) -> None:
    with beside(tmp_path) as both:
        both.until(0.02)
        told = both.answer(n=1, horizon=30.0)
        assert told.label == "model"
        assert told.outcomes[0].path[-1][1:3] == pytest.approx(_GOAL[:2], abs=0.3)


def test_what_is_commanded_through_a_guard_drives_the_virtual_robot(tmp_path: Path) -> None:
    with beside(tmp_path, guard="guard") as both:
        both.until(1.5)
        assert not both.source.commands, "no guard is there to pass anything on"
        assert both.answer(n=1, horizon=20.0).succeeded == 1


def test_a_mirror_that_only_localises_navigates_in_its_futures(tmp_path: Path) -> None:
    with beside(tmp_path, autonomy="localisation") as both:
        both.until(1.0)
        with pytest.raises(SimulationError, match=r"ask with --goal X,Y,YAW, or start the mirror with"):
            both.answer(n=1)
        (there,) = both.answer(n=1, horizon=20.0, goal=_GOAL).outcomes
        assert there.end == "arrived"
        assert there.path[-1][1:3] == pytest.approx(_GOAL[:2], abs=0.3)
        assert not both.source.commands


def test_a_mirror_without_localisation_tells_who_would_answer(tmp_path: Path) -> None:
    with beside(tmp_path, autonomy="none") as both:
        both.until(0.1)
        with pytest.raises(SimulationError, match="is not localised here; start the mirror with"):
            both.answer(n=1, goal=_GOAL)
