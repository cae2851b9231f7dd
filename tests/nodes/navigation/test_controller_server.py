"""controller_server drives a robot along its path, and ends as nav2 does where it cannot."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, open_room
from tests.nodes.navigation.servers import FOOTPRINT, HALF, Stack
from twin.bridge.action_types import FollowPath
from twin.bridge.actions import ActionClient
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import (
    DiagnosticArray,
    DiagnosticStatus,
    GoalStatus,
    MarkerArray,
    Path,
    SpeedLimit,
    Twist,
    new,
)
from twin.bridge.parameters.values import Parameter
from twin.geometry import Pose2
from twin.navigation.control.maneuver_config import ManeuverConfig
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.progress_checker import ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.nodes.messages import path_array, path_msg
from twin.nodes.navigation.controller_server.server import ControllerServerNode
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode


@pytest.fixture
def stack(bench: Bench) -> Stack:
    return Stack(bench)


def test_it_follows_a_planned_path_to_its_goal(bench: Bench, stack: Stack) -> None:
    stack.room.add_box(1.0, -0.8, 1.2, 0.5)
    bench.run(0.5)
    goal = stack.drive(stack.plan(2.4, 0.0, 0.5).result.path)
    nearest = math.inf
    while not goal.done:
        bench.tick()
        x, y = stack.robot.pose[:2]
        nearest = min(nearest, math.hypot(max(1.0 - x, 0.0, x - 1.2), max(-0.8 - y, 0.0, y - 0.5)))
    assert goal.succeeded, goal.result.error_msg
    assert stack.robot.pose.distance(Pose2(2.4, 0.0, 0.5)) < 0.06
    assert stack.robot.pose.yaw == pytest.approx(0.5, abs=0.12)
    assert nearest > HALF, "the obstacle is passed with the robot's width to spare"
    assert stack.robot.commands[-1] == (0.0, 0.0)


def test_a_stuck_robot_is_no_progress(bench: Bench) -> None:
    checker = ProgressCheckerConfig(required_movement_radius=0.3, movement_time_allowance=2.0)
    stack = Stack(bench, progress_checkers={"progress_checker": checker})
    stack.robot.stuck = True
    began = bench.now_s
    goal = stack.drive(np.array([[0, 0, 0], [2, 0, 0]], dtype=float))
    bench.until(lambda: goal.done)
    assert goal.result.error_code == 105
    assert "progress" in goal.result.error_msg
    assert bench.now_s - began == pytest.approx(2.0, abs=0.3)
    assert stack.robot.commands[-1] == (0.0, 0.0)


def test_wheels_and_a_lidar_that_contradict_each_other_end_the_drive(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The robot turns the other way than its odometry says."""
    monkeypatch.setattr(Robot, "pose", property(lambda robot: Pose2(0, 0, -robot.drive.odometry.pose.yaw)))
    stack = Stack(bench, costmap_update_timeout_ns=500_000_000)
    diagnostics = bench.listen(DiagnosticArray, "/diagnostics")
    turn = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)
    bench.each_tick.append(lambda: turn.publish(twist_from_planar(0.0, 0.5)))
    bench.run(5.0)
    assert stack.local_costmap.fault == ""
    bench.run(6.0)
    bench.each_tick.pop()
    goal = stack.drive(np.array([[0, 0, 0], [2, 0, 0]], dtype=float))
    bench.until(lambda: goal.done)
    assert goal.result.error_code == 107
    said = "wheels and lidar contradict each other: in 10 s odometry drove 0.0 m and turned 28"
    assert said in goal.result.error_msg
    assert "deg left, the scans drove 0.0 m and turned 2" in goal.result.error_msg
    assert goal.result.error_msg.endswith("deg right")
    status = diagnostics[-1].status[0]
    assert (status.name, status.level) == ("/local_costmap/local_costmap: odometry", DiagnosticStatus.ERROR)
    assert status.message.startswith("wheels and lidar contradict each other")


def test_a_cancel_stops_the_robot(bench: Bench, stack: Stack) -> None:
    goal = stack.drive(np.array([[0, 0, 0], [2, 0, 0]], dtype=float))
    bench.run(1.5)
    assert stack.robot.joints.velocity[0] > 1.0
    goal.cancel()
    bench.until(lambda: goal.done, 0.2)
    assert goal.status == GoalStatus.STATUS_CANCELED
    assert stack.robot.commands[-1] == (0.0, 0.0)
    bench.run(0.5)
    assert not stack.robot.joints.velocity.any()


def test_a_new_path_preempts_without_a_stop(bench: Bench, stack: Stack) -> None:
    old = stack.drive(np.array([[0, 0, 0], [2, 0, 0]], dtype=float))
    bench.run(1.5)
    count = len(stack.robot.commands)
    new_goal = stack.drive(np.array([[0, 0, 0], [2.4, 0, 0]], dtype=float))
    bench.until(lambda: new_goal.done)
    assert old.status == GoalStatus.STATUS_ABORTED
    assert new_goal.succeeded
    assert min(v for v, _ in stack.robot.commands[count : count + 10]) > 0.1


def test_it_stops_before_what_blocks_its_path(bench: Bench, stack: Stack) -> None:
    stack.room.add_box(1.0, -1.9, 1.2, 0.9)
    bench.run(0.5)
    goal = stack.drive(np.array([[0, 0, 0], [2, 0, 0]], dtype=float))
    bench.until(lambda: goal.done)
    assert goal.result.error_code == 104
    assert "no valid control for 0.3 s: collision in" in goal.result.error_msg
    assert stack.robot.pose.x < 1.0 - HALF
    assert stack.robot.commands[-1] == (0.0, 0.0)


@pytest.mark.parametrize(("tolerance_s", "ends"), [(-0.1, True), (-1.0, False)])
def test_only_a_tolerance_of_minus_one_is_endless(bench: Bench, tolerance_s: float, ends: bool) -> None:
    stack = Stack(bench, failure_tolerance_ns=round(tolerance_s * 1e9), maneuver=ManeuverConfig(reach=0.0))
    stack.room.add_box(0.18, -0.6, 0.8, 0.6)
    bench.run(0.5)
    goal = stack.drive(np.array([[0, 0, 0], [2, 0, 0]], dtype=float))
    bench.run(3.0)
    assert goal.done is ends
    if ends:
        assert goal.result.error_code == 106


def beside_a_box(bench: Bench, reach: float, **config: Any) -> tuple[Stack, Any]:
    """Follow a path around a box that stands before the robot's nose, too near to turn."""
    stack = Stack(bench, failure_tolerance_ns=4_000_000_000, maneuver=ManeuverConfig(reach=reach), **config)
    stack.room.add_box(0.18, -0.6, 0.8, 0.13)
    bench.run(0.5)
    path = np.array([[0.0, 0.0, 1.57], [0.0, 0.45, 0.0], [2.0, 0.45, 0.0]])
    return stack, stack.drive(path)


def test_a_blocked_robot_maneuvers_and_goes_on(bench: Bench) -> None:
    stack, goal = beside_a_box(bench, reach=1.5)
    said = bench.logs()
    bench.until(lambda: goal.done, 30.0)
    assert goal.succeeded, goal.result.error_msg
    assert any(text.startswith("maneuvering: collision in") for text in said)
    assert min(v for v, _ in stack.robot.commands) < -0.05, "it backs up"


@pytest.mark.parametrize(("reach", "outcome"), [(1.5, 0), (0.0, 105)])
def test_a_robot_that_is_blocked_again_and_again_maneuvers_before_it_gives_up(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, reach: float, outcome: int
) -> None:
    checker = ProgressCheckerConfig(required_movement_radius=0.2, movement_time_allowance=6.0)
    stack, goal = beside_a_box(bench, reach=reach, progress_checkers={"progress_checker": checker})
    (controller,) = stack.controller_server.controllers.values()
    drive, calls, said = controller.compute_velocity, itertools.count(), bench.logs()

    def every_other_time(*args: Any, **kwargs: Any) -> tuple[float, float]:
        """Find a turn that is valid but leads nowhere, until a maneuver has begun."""
        n = next(calls)
        if n % 2 or "maneuvering: no progress" in said:
            return drive(*args, **kwargs)
        return 0.0, 0.02 if n % 4 else -0.02

    monkeypatch.setattr(controller, "compute_velocity", every_other_time)
    bench.until(lambda: goal.done, 40.0)
    assert goal.result.error_code == outcome
    assert ("maneuvering: no progress" in said) == (outcome == 0)


def test_without_maneuvers_it_leaves_that_to_recoveries(bench: Bench) -> None:
    stack, goal = beside_a_box(bench, reach=0.0)
    bench.until(lambda: goal.done, 30.0)
    assert goal.result.error_code == 104
    assert min(v for v, _ in stack.robot.commands) >= 0.0


def test_a_goal_that_something_stands_on_is_planned_to_until_the_robot_waits_before_it(
    bench: Bench, stack: Stack
) -> None:
    walls = stack.room.segments
    stack.room.add_box(2.3, -0.2, 2.6, 0.2)
    bench.run(0.5)
    hoped = stack.plan(2.4, 0.0)
    assert hoped.succeeded, hoped.result.error_msg
    assert not stack.is_valid(hoped.result.path), "it is looked after, though"
    bench.run(4.0)
    given_up = stack.plan(2.4, 0.0)
    assert given_up.result.error_code == 206
    assert "something has stood at the goal (2.40, 0.00) for 4 s" in given_up.result.error_msg
    stack.room.segments = walls
    bench.run(0.5)
    assert stack.plan(2.4, 0.0).succeeded
    assert stack.is_valid(hoped.result.path)


@pytest.mark.parametrize(
    "path", [np.zeros((0, 3)), np.array([[0.0, 0.0, 0.0], [math.nan, 0.0, 0.0]])], ids=["empty", "nan"]
)
def test_a_path_that_is_none_is_refused(bench: Bench, stack: Stack, path: np.ndarray) -> None:
    goal = stack.drive(path)
    bench.until(lambda: goal.done, 1.0)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert goal.result.error_code == 103
    assert goal.result.error_msg


def test_a_path_is_followed_where_its_frame_says(bench: Bench, stack: Stack) -> None:
    ahead = np.array([[0.1 * i, 0.0, 0.0] for i in range(8)])
    aside = np.array([[0.0, 0.1 * i, math.pi / 2] for i in range(8)])
    for path in (path_msg(aside, "map", 0), path_msg(ahead, "base_footprint", 0)):
        goal = stack.drive(path)
        bench.until(lambda goal=goal: goal.done, 10.0)
        assert goal.status == GoalStatus.STATUS_SUCCEEDED
    assert stack.robot.pose.distance(Pose2(0.0, 1.4, 0.0)) < 0.2, "ahead of where it stood after the first"
    lost = stack.drive(path_msg(ahead, "moon", 0))
    bench.until(lambda: lost.done, 1.0)
    assert (lost.status, lost.result.error_code) == (GoalStatus.STATUS_ABORTED, 102)
    assert "frame 'moon' has no transform to 'map'" in lost.result.error_msg
    assert not stack.is_valid(path_msg(ahead, "moon", 0))


def test_an_unlocalised_robot_does_not_drive(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    robot.localised = False
    rolling = CostmapConfig(footprint=FOOTPRINT, rolling_window=True)
    costmap = CostmapNode(
        bench.bus, robot.pose_lookup, CostmapNodeConfig(name="local_costmap", frame="odom", layers=rolling)
    )
    ControllerServerNode(bench.bus, robot.pose_lookup, costmap, np.array(FOOTPRINT))
    client = ActionClient(bench.node, FollowPath, "follow_path")
    path = path_msg(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), "map", 0)
    goal = client.send_goal(new(FollowPath.Goal, path=path))
    bench.until(lambda: goal.done, 1.0)
    assert goal.result.error_code == 102
    assert robot.commands[-1] == (0.0, 0.0)


def test_controllers_and_checkers_are_chosen_by_name(bench: Bench) -> None:
    stack = Stack(
        bench,
        controllers={
            "FollowPath": RegulatedPurePursuitConfig(desired_linear_vel=0.4),
            "Slow": RegulatedPurePursuitConfig(
                desired_linear_vel=0.2, regulated_linear_scaling_min_speed=0.1
            ),
        },
    )
    message = path_msg(np.array([[0, 0, 0], [2, 0, 0]], dtype=float), "map", 0)
    for name, speed in (("", 0.4), ("Slow", 0.2), ("FollowPath", 0.4)):
        goal = stack.follow.send_goal(new(FollowPath.Goal, path=message, controller_id=name))
        bench.run(1.0)
        assert stack.robot.commands[-1][0] == pytest.approx(speed)
        goal.cancel()
        bench.until(lambda goal=goal: goal.done, 0.2)  # type: ignore[misc]
    for field in ("controller_id", "goal_checker_id", "progress_checker_id"):
        goal = stack.follow.send_goal(new(FollowPath.Goal, path=message, **{field: "Fats"}))
        bench.until(lambda goal=goal: goal.done, 1.0)  # type: ignore[misc]
        assert goal.result.error_code == 101
        assert "'Fats'; valid: " in goal.result.error_msg


def test_a_speed_limit_is_absolute_or_in_percent_until_it_is_lifted(bench: Bench, stack: Stack) -> None:
    limits = bench.node.create_publisher(SpeedLimit, "speed_limit", 1)
    said = bench.logs()
    stack.drive(np.array([[-2, 0, 0], [2, 0, 0]], dtype=float))
    for limit, percentage, speed in (
        (0.3, False, 0.3),
        (80.0, True, 0.4),
        (0.0, False, 0.5),
        (math.nan, False, 0.5),
    ):
        limits.publish(new(SpeedLimit, speed_limit=limit, percentage=percentage))
        bench.run(0.3)
        assert stack.robot.commands[-1][0] == pytest.approx(speed)
    assert any("speed_limit refused" in text for text in said)


def test_a_speed_limit_outlives_a_change_of_parameters(bench: Bench, stack: Stack) -> None:
    limits = bench.node.create_publisher(SpeedLimit, "speed_limit", 1)
    stack.drive(np.array([[-2, 0, 0], [2, 0, 0]], dtype=float))
    limits.publish(new(SpeedLimit, speed_limit=0.3))
    bench.run(0.3)
    stack.controller_server.node.set_parameters([Parameter("FollowPath.lookahead_dist", value=0.5)])
    bench.run(0.5)
    assert stack.robot.commands[-1][0] == pytest.approx(0.3)


def test_the_feedback_and_the_local_plan_tell_where_it_goes(bench: Bench, stack: Stack) -> None:
    plans = bench.listen(Path, "transformed_global_plan", 1)
    heard: list[Any] = []
    path = path_msg(np.array([[0, 0, 0], [2, 0, 0]], dtype=float), "map", 0)
    stack.follow.send_goal(new(FollowPath.Goal, path=path), feedback_callback=heard.append)
    bench.run(2.0)
    assert heard[-1].speed == pytest.approx(0.5, abs=0.05)
    assert heard[-1].distance_to_goal == pytest.approx(2.0 - stack.robot.pose.x, abs=0.05)
    ahead = path_array(plans[-1])
    assert ahead[0, 0] == pytest.approx(stack.robot.pose.x, abs=0.08)
    assert ahead[-1, :2] == pytest.approx([2.0, 0.0])


@pytest.mark.xdist_group("planning")
def test_mppis_rollouts_are_shown_to_those_who_look(bench: Bench) -> None:
    stack = Stack(bench, controllers={"FollowPath": MPPIConfig(batch_size=100, time_steps=30)})
    sent = stack.plan(2.5, 1.5)
    got = bench.listen(MarkerArray, "trajectories")
    stack.drive(sent.result.path)
    bench.run(1.0)
    candidates, best = got[-1].markers
    assert (candidates.ns, best.ns) == ("Candidate Trajectories", "Optimal Trajectory")
    assert candidates.header.frame_id == "map"
    assert len(candidates.points) == len(candidates.colors) == 100 // 5 * 30 // 3
    first = best.points[0]
    assert math.hypot(first.x - stack.robot.pose.x, first.y - stack.robot.pose.y) < 0.2
