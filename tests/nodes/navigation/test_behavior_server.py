"""behavior_server on ideal wheels: what it does, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench, Robot, open_room
from twin.bridge.action_types import (
    AssistedTeleop,
    BackUp,
    DriveOnHeading,
    Spin,
    Wait,
)
from twin.bridge.actions import ActionClient
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import (
    Empty,
    GoalStatus,
    Point,
    Twist,
    duration,
    new,
)
from twin.bridge.types import ActionType
from twin.geometry import wrap_angle
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.recovery import BehaviorConfig
from twin.nodes.navigation.behavior_server import BehaviorServerNode
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode

FOOTPRINT = ((0.15, 0.15), (-0.15, 0.15), (-0.15, -0.15), (0.15, -0.15))
LONG = duration(30_000_000_000)


class Behaviors:
    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.robot = Robot(bench, open_room())
        rolling = CostmapConfig(footprint=FOOTPRINT, rolling_window=True)
        config = CostmapNodeConfig(name="local_costmap", frame="odom", layers=rolling)
        costmap = CostmapNode(bench.bus, self.robot.pose_lookup, config)
        behavior = BehaviorConfig(footprint=FOOTPRINT)
        BehaviorServerNode(bench.bus, self.robot.pose_lookup, behavior, costmap=costmap)
        bench.run(0.5)

    def send(self, action: ActionType, name: str, **fields: Any) -> Any:
        return ActionClient(self.bench.node, action, name).send_goal(new(action.Goal, **fields))

    def do(self, action: ActionType, name: str, **fields: Any) -> Any:
        goal = self.send(action, name, **fields)
        self.bench.until(lambda: goal.done)
        self.bench.run(0.3)
        return goal


@pytest.fixture
def behaviors(bench: Bench) -> Behaviors:
    return Behaviors(bench)


@pytest.mark.parametrize("angle", [math.pi / 2, -math.pi / 2, 1.5 * math.pi])
def test_spin_turns_by_the_angle_on_the_spot(behaviors: Behaviors, angle: float) -> None:
    goal = behaviors.do(Spin, "spin", target_yaw=angle, time_allowance=LONG)
    assert goal.succeeded
    pose = behaviors.robot.pose
    assert abs(wrap_angle(pose.yaw - angle)) < 0.05
    assert math.hypot(pose.x, pose.y) < 1e-6
    turned = np.array([w for _, w in behaviors.robot.commands]).sum() * TICK_NS * 1e-9
    assert turned == pytest.approx(angle, abs=0.1), "the way round that was asked for, all of it"


def test_drive_on_heading_and_backup_are_straight(behaviors: Behaviors) -> None:
    ahead = Point(x=0.5, y=0.0, z=0.0)
    goal = behaviors.do(DriveOnHeading, "drive_on_heading", target=ahead, speed=0.2, time_allowance=LONG)
    assert goal.succeeded
    assert behaviors.robot.pose == pytest.approx((0.5, 0.0, 0.0), abs=0.02)
    back = Point(x=0.3, y=0.0, z=0.0)
    assert behaviors.do(BackUp, "backup", target=back, speed=0.1, time_allowance=LONG).succeeded
    assert behaviors.robot.pose == pytest.approx((0.2, 0.0, 0.0), abs=0.02)
    assert min(v for v, _ in behaviors.robot.commands) == pytest.approx(-0.1)
    assert max(v for v, _ in behaviors.robot.commands) == pytest.approx(0.2)


def test_driving_into_a_wall_is_refused_before_it(behaviors: Behaviors) -> None:
    behaviors.robot.room.add_box(0.8, -1.0, 1.0, 1.0)
    behaviors.bench.run(0.5)
    ahead = Point(x=2.0, y=0.0, z=0.0)
    goal = behaviors.do(DriveOnHeading, "drive_on_heading", target=ahead, speed=0.2, time_allowance=LONG)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert (goal.result.error_code, goal.result.error_msg) == (723, "drive_on_heading: collision ahead")
    assert behaviors.robot.pose.x < 0.8 - 0.15
    assert behaviors.robot.commands[-1] == (0.0, 0.0)


def test_a_behavior_that_takes_too_long_is_aborted(behaviors: Behaviors) -> None:
    behaviors.robot.stuck = True
    goal = behaviors.do(Spin, "spin", target_yaw=1.0, time_allowance=duration(1_000_000_000))
    assert (goal.result.error_code, goal.result.error_msg) == (701, "spin: timeout")


def test_wait_waits_without_driving(behaviors: Behaviors) -> None:
    began = behaviors.bench.now_s
    goal = behaviors.send(Wait, "wait", time=duration(2_000_000_000))
    behaviors.bench.until(lambda: goal.done)
    assert goal.succeeded
    assert behaviors.bench.now_s - began == pytest.approx(2.0, abs=0.1)
    assert set(behaviors.robot.commands) <= {(0.0, 0.0)}


def test_a_cancelled_behavior_stops_the_robot(behaviors: Behaviors) -> None:
    goal = behaviors.send(Spin, "spin", target_yaw=3.0, time_allowance=LONG)
    behaviors.bench.run(1.0)
    assert behaviors.robot.joints.velocity.any()
    goal.cancel()
    behaviors.bench.until(lambda: goal.done, 0.2)
    assert goal.status == GoalStatus.STATUS_CANCELED
    behaviors.bench.run(0.3)
    assert not behaviors.robot.joints.velocity.any()


def test_feedback_tells_how_far_it_is(behaviors: Behaviors) -> None:
    told: list[Any] = []
    client = ActionClient(behaviors.bench.node, DriveOnHeading, "drive_on_heading")
    target = Point(x=0.5, y=0.0, z=0.0)
    goal = client.send_goal(
        new(DriveOnHeading.Goal, target=target, speed=0.2, time_allowance=LONG), told.append
    )
    behaviors.bench.until(lambda: goal.done)
    driven = [message.distance_traveled for message in told]
    assert driven == sorted(driven)
    assert driven[0] == 0.0
    assert driven[-1] == pytest.approx(0.5, abs=0.02)
    assert goal.result.total_elapsed_time.sec >= 2


@pytest.mark.parametrize(
    ("action", "name", "x", "y", "speed", "code"),
    [
        (BackUp, "backup", 0.3, 0.1, 0.1, 713),
        (DriveOnHeading, "drive_on_heading", 0.3, 0.1, 0.1, 724),
        (DriveOnHeading, "drive_on_heading", 0.3, 0.0, -0.1, 724),
    ],
)
def test_a_goal_that_makes_no_sense_is_aborted(
    behaviors: Behaviors, action: ActionType, name: str, x: float, y: float, speed: float, code: int
) -> None:
    goal = behaviors.do(action, name, target=Point(x=x, y=y, z=0.0), speed=speed, time_allowance=LONG)
    assert (goal.result.error_code, goal.result.error_msg) == (code, f"{name}: invalid input")


def test_assisted_teleop_does_what_is_steered_but_never_hits(behaviors: Behaviors) -> None:
    bench, robot = behaviors.bench, behaviors.robot
    robot.room.add_box(1.0, -1.0, 1.2, 1.0)
    steer = bench.node.create_publisher(Twist, "cmd_vel_assisted_teleop", 10)
    goal = behaviors.send(AssistedTeleop, "assisted_teleop", time_allowance=LONG)
    bench.run(0.5)
    steer.publish(twist_from_planar(0.3, 0.0))
    bench.run(0.3)
    assert robot.commands[-1] == (0.3, 0.0), "far away from everything it does as it is told"
    bench.run(8.0)
    assert robot.pose.x < 1.0 - 0.15, "the wall is not touched"
    assert robot.pose.x > 0.6
    assert robot.commands[-1] == (0.0, 0.0)
    steer.publish(twist_from_planar(-0.3, 0.0))
    bench.run(1.0)
    assert robot.commands[-1] == (-0.3, 0.0), "away from the wall it may"
    bench.node.create_publisher(Empty, "preempt_teleop", 10).publish(Empty())
    bench.until(lambda: goal.done, 0.5)
    assert goal.succeeded
    bench.run(0.2)
    assert robot.commands[-1] == (0.0, 0.0)


def test_assisted_teleop_ends_when_its_time_is_over(behaviors: Behaviors) -> None:
    goal = behaviors.do(AssistedTeleop, "assisted_teleop", time_allowance=duration(1_000_000_000))
    assert (goal.result.error_code, goal.result.error_msg) == (731, "assisted_teleop: timeout")


@pytest.mark.parametrize(
    ("action", "name", "fields"),
    [
        (Spin, "spin", {"target_yaw": math.nan}),
        (BackUp, "backup", {"target": Point(x=math.inf, y=0.0, z=0.0), "speed": 0.1}),
        (DriveOnHeading, "drive_on_heading", {"target": Point(x=1.0, y=0.0, z=0.0), "speed": math.nan}),
    ],
)
def test_a_goal_that_is_not_finite_is_rejected(
    behaviors: Behaviors, action: ActionType, name: str, fields: dict[str, Any]
) -> None:
    goal = behaviors.do(action, name, **fields)
    assert goal.accepted is False
    assert not behaviors.robot.commands
