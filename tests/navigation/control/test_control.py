from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.geometry import Pose2, wrap_angle
from twin.navigation.control.goal_checker import GoalCheckerConfig, SimpleGoalChecker
from twin.navigation.control.progress_checker import SimpleProgressChecker
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.regulated_pure_pursuit.controller import RegulatedPurePursuit
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.failures import InvalidPath, NoValidControl
from twin.navigation.planning.planner import with_headings
from twin.navigation.recovery import (
    COLLISION_AHEAD,
    TIMEOUT,
    BehaviorConfig,
    BehaviorStep,
    DriveOnHeading,
    Spin,
    Wait,
)
from twin.runtime.defaults.controllers import controller_server_config
from twin.scenario.controllers import ControllerParameters

DT = 0.05


def move(pose: Pose2, v: float, w: float, dt: float = DT) -> Pose2:
    """Exact unicycle."""
    return pose @ Pose2(v * dt * np.sinc(w * dt / (2 * np.pi)), 0.0, 0.0) @ Pose2(0.0, 0.0, w * dt)


def line(length: float, spacing: float = 0.05) -> np.ndarray:
    x = np.arange(0.0, length + 1e-9, spacing)
    return with_headings(np.column_stack([x, np.zeros_like(x)]))


def follow(
    controller: RegulatedPurePursuit,
    pose: Pose2,
    path: np.ndarray,
    steps: int,
    costmap: Costmap | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Drive; return poses and commands."""
    command, poses, commands = (0.0, 0.0), [pose], []
    for _ in range(steps):
        command = controller.compute_velocity(pose, command, path, costmap, DT)
        pose = move(pose, *command)
        poses.append(pose)
        commands.append(command)
    return np.array(poses), np.array(commands)


def rpp(**changes: float | bool) -> RegulatedPurePursuit:
    return RegulatedPurePursuit(config=RegulatedPurePursuitConfig(**changes), footprint=rectangle(0.4, 0.3))


def empty(size: float = 8.0) -> Costmap:
    n = round(size / 0.05)
    costs = np.zeros((n, n), dtype=np.uint8)
    return Costmap(costs=costs, resolution=0.05, origin=(-size / 2, -size / 2), inscribed_radius=0.15)


def test_a_lateral_offset_is_steered_out() -> None:
    poses, _ = follow(rpp(), Pose2(0.0, 0.2, 0.0), line(5.0), 160)
    assert abs(poses[-1, 1]) < 0.005
    assert poses[:, 1].min() > -0.03


def test_curvature_is_that_of_the_arc_through_the_carrot() -> None:
    controller = rpp(use_regulated_linear_velocity_scaling=False)
    v, w = controller.compute_velocity(Pose2(0.0, 0.1, 0.0), (0.5, 0.0), line(5.0), None, DT)
    assert controller.carrot is not None
    x, y = controller.carrot
    assert math.hypot(x, y - 0.1) == pytest.approx(0.6)
    assert w / v == pytest.approx(2.0 * (y - 0.1) / 0.6**2)


def test_speed_in_a_tight_turn_and_at_the_end() -> None:
    angles = np.linspace(-np.pi / 2, np.pi, 200)
    circle = with_headings(np.column_stack([0.45 * np.cos(angles), 0.45 + 0.45 * np.sin(angles)]))
    v, _ = rpp(lookahead_dist=0.3).compute_velocity(Pose2(0.0, 0.0, 0.0), (0.5, 0.0), circle, None, DT)
    assert v == pytest.approx(0.5 * 0.45 / 0.9, abs=0.01)
    near_end, _ = rpp(max_robot_pose_search_dist=9.0).compute_velocity(
        Pose2(4.7, 0.0, 0.0), (0.5, 0.0), line(5.0), None, DT
    )
    assert near_end == pytest.approx(0.5 * 0.3 / 0.6)


def test_speed_near_obstacles() -> None:
    costmap = empty()
    costmap.costs[:] = 200
    clearance = costmap.inscribed_radius - math.log(200 / 252) / costmap.cost_scaling_factor
    v, _ = rpp(regulated_linear_scaling_min_speed=0.05).compute_velocity(
        Pose2(0.0, 0.0, 0.0), (0.5, 0.0), line(3.0), costmap, DT
    )
    assert v == pytest.approx(0.5 * clearance / 0.6)


def test_velocity_scaled_lookahead() -> None:
    for speed, want in ((0.0, 0.3), (0.4, 0.6), (2.0, 0.9)):
        controller = rpp(use_velocity_scaled_lookahead_dist=True)
        controller.compute_velocity(Pose2(0.0, 0.0, 0.0), (speed, 0.0), line(3.0), None, DT)
        assert controller.carrot == pytest.approx((want, 0.0))


def test_a_path_behind_is_turned_to_within_the_acceleration_limit() -> None:
    poses, commands = follow(rpp(), Pose2(0.0, 0.0, 3.0), line(5.0), 60)
    turning = commands[:20]
    assert (turning[:10, 0] == 0.0).all()
    assert np.abs(np.diff(np.concatenate([[0.0], turning[:10, 1]]))).max() <= 3.2 * DT + 1e-9
    assert np.abs(commands[:, 1]).max() <= 1.8
    assert poses[-1, 0] > 0.2


@pytest.mark.parametrize("late", [0, 2, 4])
@pytest.mark.parametrize("heading", [1.0, 1.8, -1.4, -3.0])
def test_a_base_that_speeds_up_slowly_and_lags_does_not_turn_past_the_path(heading: float, late: int) -> None:
    """As behind a velocity smoother, whose commands come to the wheels that many periods later."""
    smoother, path, dt = VelocitySmootherConfig(), line(12.0), 0.06
    config = controller_server_config(ControllerParameters(), smoother).controllers["FollowPath"]
    controller = RegulatedPurePursuit(config=config, footprint=rectangle(0.4, 0.3))
    pose, actual, under_way = Pose2(0.0, 0.0, heading), (0.0, 0.0), [(0.0, 0.0)] * late
    driven, past = False, 0.0
    for _ in range(120):
        command = controller.compute_velocity(pose, actual, path, None, dt)
        assert not (driven and command[0] == 0.0), "it stops to turn back"
        driven = command[0] > 0.0
        under_way.append(command)
        v, w = under_way.pop(0)
        most_v, most_w = 0.8 * dt, 2.0 * dt
        actual = (
            actual[0] + min(max(v - actual[0], -most_v), most_v),
            actual[1] + min(max(w - actual[1], -most_w), most_w),
        )
        pose = move(pose, *actual, dt)
        past = max(past, -math.copysign(1.0, heading) * pose.yaw) if driven else past
    assert past < 0.35
    assert abs(pose.y) < 0.1


def test_the_goals_heading_is_reached_by_turning_at_the_goal() -> None:
    path = line(1.0)
    path[-1, 2] = -2.0
    checker = SimpleGoalChecker(config=GoalCheckerConfig(xy_goal_tolerance=0.05, yaw_goal_tolerance=0.02))
    poses, commands = follow(rpp(xy_goal_tolerance=0.05), Pose2(0.0, 0.0, 0.0), path, 200)
    assert checker.is_goal_reached(Pose2(*poses[-1]), Pose2(*path[-1]))
    assert abs(commands[-1, 1]) < 0.05


@pytest.mark.parametrize("spacing", [0.01, 0.05, 5.0])
def test_spacing_of_the_path_hardly_matters(spacing: float) -> None:
    poses, _ = follow(rpp(), Pose2(0.0, 0.3, 0.2), line(5.0, spacing), 100)
    reference, _ = follow(rpp(), Pose2(0.0, 0.3, 0.2), line(5.0, 0.1), 100)
    assert poses[-1] == pytest.approx(reference[-1], abs=0.02)


def test_a_path_that_crosses_itself_is_followed_in_order() -> None:
    turn = np.linspace(-np.pi / 2, np.pi, 150)
    loop = np.column_stack([3.0 + np.cos(turn), 1.0 + np.sin(turn)])
    path = with_headings(np.concatenate([line(3.0)[:, :2], loop, [[2.0, -2.0]]]))
    poses, _ = follow(rpp(), Pose2(0.0, 0.0, 0.0), path, 440)
    assert poses[:, 0].max() > 3.8
    assert poses[-1, :2] == pytest.approx((2.0, -2.0), abs=0.3)


def test_a_collision_ahead_is_no_valid_control_and_one_behind_is_none_of_our_business() -> None:
    costmap = empty()
    costmap.costs[70:90, 90:92] = 254  # x from 0.5 m
    with pytest.raises(NoValidControl, match="collision") as caught:
        rpp().compute_velocity(Pose2(0.0, 0.0, 0.0), (0.5, 0.0), line(3.0), costmap, DT)
    assert caught.value.error_code == 106
    ahead = np.add(line(3.0), (0.9, 0.0, 0.0))
    v, _ = rpp().compute_velocity(Pose2(0.9, 0.0, 0.0), (0.5, 0.0), ahead, costmap, DT)
    assert v > 0.0
    assert rpp(use_collision_detection=False).compute_velocity(
        Pose2(0.0, 0.0, 0.0), (0.5, 0.0), line(3.0), costmap, DT
    )[0]


def test_turning_a_corner_into_an_obstacle_is_refused() -> None:
    costmap = empty()
    costmap.costs[84:86, 80] = 254  # 0.2..0.3 m to the left of the robot's middle
    with pytest.raises(NoValidControl):
        rpp().compute_velocity(Pose2(0.02, 0.0, 3.0), (0.0, -1.8), line(3.0), costmap, 0.5)


@pytest.mark.parametrize("path", [np.zeros((0, 3)), np.zeros((3, 2)), np.full((2, 3), np.nan)])
def test_what_is_not_a_path(path: np.ndarray) -> None:
    with pytest.raises(InvalidPath):
        rpp().compute_velocity(Pose2(0.0, 0.0, 0.0), (0.0, 0.0), path, None, DT)


def test_a_new_path_is_driven_while_it_still_brakes_for_a_cancel() -> None:
    controller, path = rpp(use_cancel_deceleration=True, cancel_deceleration=0.5), line(3.0)
    look = Pose2(0.0, 0.0, 0.0), (0.4, 0.0)
    assert controller.compute_velocity(*look, path, None, DT)[0] == pytest.approx(0.5)
    assert not controller.cancel()
    assert controller.compute_velocity(*look, path, None, DT)[0] == pytest.approx(0.4 - 0.5 * DT)
    assert controller.compute_velocity(*look, line(4.0), None, DT)[0] == pytest.approx(0.5)


def test_speed_limit() -> None:
    controller, path = rpp(), line(5.0)
    for limit, want in ((0.3, 0.3), (2.0, 0.5), (None, 0.5)):
        controller.set_speed_limit(limit)
        assert controller.compute_velocity(Pose2(1.0, 0.0, 0.0), (0.0, 0.0), path, None, DT)[0] == want


def test_goal_checker_remembers_the_position_if_stateful() -> None:
    goal = Pose2(1.0, 0.0, math.pi)
    for stateful in (True, False):
        checker = SimpleGoalChecker(config=GoalCheckerConfig(stateful=stateful))
        assert not checker.is_goal_reached(Pose2(0.8, 0.0, 0.0), goal)
        assert checker.is_goal_reached(Pose2(0.7, 0.0, -math.pi + 0.1), goal) is stateful
        checker.reset()
        assert not checker.is_goal_reached(Pose2(0.7, 0.0, -math.pi + 0.1), goal)


def test_progress_checker() -> None:
    checker = SimpleProgressChecker()
    second = 1_000_000_000
    assert checker.check(Pose2(0.0, 0.0, 0.0), 0)
    assert checker.check(Pose2(0.4, 0.0, 0.0), 10 * second)
    assert not checker.check(Pose2(0.4, 0.0, 0.0), 10 * second + 1_000_000)
    assert checker.check(Pose2(0.6, 0.0, 0.0), 11 * second)
    assert checker.check(Pose2(0.6, 0.0, 0.0), 21 * second)
    checker.reset()
    assert checker.check(Pose2(0.6, 0.0, 0.0), 99 * second)


def execute(
    update: Callable[..., BehaviorStep], costmap: Costmap | None = None, steps: int = 400
) -> tuple[Pose2, list[BehaviorStep]]:
    pose, log = Pose2(0.0, 0.0, 0.5), []
    for _ in range(steps):
        log.append(update(pose, DT, costmap))
        if log[-1].done or log[-1].failed_reason:
            break
        pose = move(pose, log[-1].v, log[-1].w)
    return pose, log


@pytest.mark.parametrize("angle", [0.3, -1.57, 3.5, -7.0])
def test_spin_turns_by_the_angle_and_stops(angle: float) -> None:
    pose, log = execute(Spin(target_yaw=angle).update)
    assert log[-1].done
    assert wrap_angle(pose.yaw - 0.5 - angle) == pytest.approx(0.0, abs=2e-3)
    assert sum(step.w for step in log) * DT == pytest.approx(angle, abs=2e-3)
    assert max(abs(step.w) for step in log) <= 1.0
    assert abs(log[0].w) == 0.4, "from rest: min_rotational_vel, as 3.2 rad/s² give less in a tick"


@pytest.mark.parametrize("distance", [0.5, -0.3])
def test_driving_on_a_heading(distance: float) -> None:
    config = BehaviorConfig(acceleration_limit=0.5, deceleration_limit=0.5)
    pose, log = execute(DriveOnHeading(config=config, target_distance=distance, speed=0.3).update)
    assert log[-1].done
    assert Pose2(0.0, 0.0, 0.5).inverse() @ pose == pytest.approx((distance, 0.0, 0.0), abs=2e-3)
    speeds = np.abs([step.v for step in log])
    assert speeds.max() <= 0.3
    assert np.diff(speeds, prepend=0.0).max() <= 0.5 * DT + 0.05


def test_backing_up_by_default() -> None:
    pose, log = execute(DriveOnHeading(target_distance=-0.15).update)
    assert log[-1].done
    assert (Pose2(0.0, 0.0, 0.5).inverse() @ pose).x == pytest.approx(-0.15, abs=2e-3)


def test_behaviours_stop_before_they_hit_something() -> None:
    costmap = empty()
    costmap.costs[:, 94:] = 254  # x >= 0.7
    footprint = tuple(map(tuple, rectangle(0.4, 0.3).tolist()))
    config = BehaviorConfig(footprint=footprint)  # type: ignore[arg-type]
    pose, log = execute(DriveOnHeading(config=config, target_distance=2.0, speed=0.3).update, costmap)
    assert log[-1].failed_reason == COLLISION_AHEAD
    front = pose.apply(np.array(footprint))[:, 0].max()
    assert 0.0 < front < 0.7
    _, log = execute(DriveOnHeading(config=config, target_distance=-0.15).update, costmap)
    assert log[-1].done
    costmap.costs[:] = 0
    costmap.costs[84, 78] = 254  # between two corners of the robot
    _, log = execute(Spin(config=config, target_yaw=2.0).update, costmap)
    assert log[-1].failed_reason == COLLISION_AHEAD


def test_behaviours_time_out() -> None:
    stuck = DriveOnHeading(target_distance=5.0, time_allowance=1.0)
    log = [stuck.update(Pose2(0.0, 0.0, 0.0), DT) for _ in range(21)]
    assert [step.failed_reason for step in log[:20]] == [None] * 20
    assert log[20] == BehaviorStep(0.0, 0.0, failed_reason=TIMEOUT)


def test_waiting() -> None:
    _, log = execute(Wait(duration=1.0).update)
    assert len(log) == 20
    assert log[-1].done
    assert all((step.v, step.w) == (0.0, 0.0) for step in log)


def test_the_last_metre_is_not_slower_than_the_least_approach_speed() -> None:
    """nav2_regulated_pure_pursuit, approachVelocityConstraint: min_approach_linear_velocity holds."""
    for left, want in ((0.3, 0.25), (0.06, 0.08), (0.03, 0.08)):
        controller = rpp(
            max_robot_pose_search_dist=9.0, min_approach_linear_velocity=0.08, use_rotate_to_heading=False
        )
        controller.reset()
        pose = Pose2(5.0 - left, 0.0, 0.0)
        v, _ = controller.compute_velocity(pose, (0.5, 0.0), line(5.0), None, DT)
        assert v == pytest.approx(want), left


def test_a_cancelled_robot_brakes_along_the_path_and_may_be_stopped_when_it_stands() -> None:
    controller, path, v = rpp(use_cancel_deceleration=True, cancel_deceleration=3.2), line(3.0), 0.5
    controller.compute_velocity(Pose2(0.0, 0.0, 0.0), (v, 0.0), path, None, DT)
    assert not controller.cancel()
    for want in (0.34, 0.18, 0.02, 0.0):
        assert not controller.cancel()
        v, _ = controller.compute_velocity(Pose2(0.0, 0.0, 0.0), (v, 0.0), path, None, DT)
        assert v == pytest.approx(want)
    assert controller.cancel()
    assert rpp().cancel(), "at once, if it is not to brake by itself"
