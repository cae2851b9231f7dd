"""Map, costmap, planner and controller servers, driving a robot with ideal wheels in a room of walls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge.action_types import ComputePathToPose, FollowPath
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import GoalStatus, MarkerArray, OccupancyGrid, Path, SpeedLimit, new
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import ClearEntireCostmap, GetMap, IsPathValid
from twin.geometry import Pose2
from twin.navigation.control.goal_checker import GoalCheckerConfig
from twin.navigation.control.maneuver import ManeuverConfig
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.progress_checker import ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.planning.planner import PlannerConfig, path_length
from twin.nodes.messages import path_array, path_msg, pose_stamped
from twin.nodes.navigation.controller_server import ControllerServerNode
from twin.nodes.navigation.controller_server_config import ControllerServerConfig
from twin.nodes.navigation.costmap import CostmapNode, CostmapNodeConfig
from twin.nodes.navigation.map_server import MapServerNode, occupancy_map
from twin.nodes.navigation.planner_server import PlannerServerNode

HALF = 0.15
FOOTPRINT = ((HALF, HALF), (-HALF, HALF), (-HALF, -HALF), (HALF, -HALF))
LAYERS = CostmapConfig(
    footprint=FOOTPRINT, inflation_radius=0.4, obstacle_max_range=4.0, raytrace_max_range=5.0
)


class Stack:
    """A robot with the nodes that take it along a path."""

    def __init__(self, bench: Bench, **controller: Any) -> None:
        bus = bench.bus
        self.bench, self.room = bench, open_room()
        self.robot = Robot(bench, self.room)
        pose = self.robot.pose_lookup
        MapServerNode(bus, map_of_room())
        self.global_costmap = CostmapNode(
            bus, pose, CostmapNodeConfig(name="global_costmap", frame="map", layers=LAYERS)
        )
        rolling = CostmapConfig(footprint=FOOTPRINT, inflation_radius=0.4, rolling_window=True)
        self.local_costmap = CostmapNode(
            bus, pose, CostmapNodeConfig(name="local_costmap", frame="odom", layers=rolling)
        )
        config = PlannerConfig(tolerance=0.1, allow_unknown=False)
        PlannerServerNode(bus, pose, self.global_costmap, config=config)
        ControllerServerNode(
            bus,
            pose,
            self.local_costmap,
            np.array(FOOTPRINT),
            ControllerServerConfig(
                goal_checkers={
                    "general_goal_checker": GoalCheckerConfig(xy_goal_tolerance=0.05, yaw_goal_tolerance=0.1)
                },
                **controller,
            ),
        )
        self.compute = ActionClient(bench.node, ComputePathToPose, "compute_path_to_pose")
        self.follow = ActionClient(bench.node, FollowPath, "follow_path")
        bench.run(1.0)

    def plan(self, x: float, y: float, yaw: float = 0.0, start: Pose2 | None = None) -> Any:
        goal = new(ComputePathToPose.Goal, goal=pose_stamped(Pose2(x, y, yaw), "map", 0))
        if start is not None:
            goal.start, goal.use_start = pose_stamped(start, "map", 0), True
        sent = self.compute.send_goal(goal)
        self.bench.until(lambda: sent.done, 2.0)
        return sent

    def is_valid(self, path: Path) -> bool:
        return bool(
            self.bench.call(IsPathValid, "is_path_valid", new(IsPathValid.Request, path=path)).is_valid
        )

    def drive(self, path: Path | np.ndarray) -> Any:
        message = path if isinstance(path, Path) else path_msg(path, "map", self.bench.clock.now_ns)
        return self.follow.send_goal(new(FollowPath.Goal, path=message))

    def cost(self, x: float, y: float) -> int:
        assert self.global_costmap.costmap is not None
        return self.global_costmap.costmap.cost_at(x, y)


@pytest.fixture
def stack(bench: Bench) -> Stack:
    return Stack(bench)


# map_server


def test_the_map_reaches_late_subscribers_and_callers(bench: Bench) -> None:
    grid = map_of_room()
    MapServerNode(bench.bus, grid)
    bench.run(1.0)
    got = bench.listen(OccupancyGrid, "map", LATCHED)
    bench.run(0.1)
    assert len(got) == 1
    answer = bench.call(GetMap, "map_server/map", new(GetMap.Request)).map
    for message in (got[0], answer):
        assert message.header.frame_id == "map"
        same = occupancy_map(message)
        assert np.array_equal(same.data, grid.data)
        assert (same.resolution, same.origin) == (pytest.approx(grid.resolution), grid.origin)


# costmap


def test_a_map_of_the_wrong_size_is_refused_and_said(bench: Bench, stack: Stack) -> None:
    said = bench.logs()
    before = stack.global_costmap.costmap
    grid = MapServerNode(bench.bus, map_of_room(), namespace="/elsewhere").message
    wrong = new(OccupancyGrid, header=grid.header, info=grid.info, data=grid.data[:-7])
    bench.node.create_publisher(OccupancyGrid, "/map", LATCHED).publish(wrong)
    bench.run(0.2)
    assert any("map refused" in text and "values is none" in text for text in said)
    assert stack.global_costmap.costmap is before, "the map it had stays"


def test_an_obstacle_on_no_map_is_marked_and_cleared_again(bench: Bench, stack: Stack) -> None:
    walls = stack.room.segments
    assert stack.cost(-1.0, 0.0) == 0
    assert stack.cost(3.02, 0.0) == 254, "the wall of the static map"
    stack.room.add_box(-1.2, -0.2, -1.0, 0.2)
    bench.run(0.5)
    assert stack.cost(-0.98, 0.0) == 254
    assert stack.cost(-0.85, 0.0) == 253, "less than the inscribed radius away"
    assert 0 < stack.cost(-0.75, 0.0) < 253
    assert stack.cost(-0.4, 0.0) == 0
    stack.room.segments = walls
    bench.run(0.5)
    assert stack.cost(-0.98, 0.0) == 0, "beams pass through it: it is gone"


def test_the_clear_service_forgets_obstacles_but_not_the_map(bench: Bench, stack: Stack) -> None:
    stack.room.add_box(-1.2, -0.2, -1.0, 0.2)
    bench.run(0.5)
    stack.robot.blind = True
    bench.run(0.5)
    assert stack.cost(-0.98, 0.0) == 254, "what nobody looks at stays"
    name = "global_costmap/clear_entirely_global_costmap"
    bench.call(ClearEntireCostmap, name, new(ClearEntireCostmap.Request))
    assert stack.cost(-0.98, 0.0) == 0
    assert stack.cost(3.02, 0.0) == 254


def test_the_published_costmap_has_nav2s_values(bench: Bench, stack: Stack) -> None:
    got = bench.listen(OccupancyGrid, "global_costmap/costmap", LATCHED)
    bench.run(1.5)
    message, costmap = got[-1], stack.global_costmap.costmap
    assert costmap is not None
    data = message.data.reshape(message.info.height, message.info.width)
    assert message.header.frame_id == "map"
    assert (message.info.origin.position.x, message.info.origin.position.y) == (-3.5, -2.5)
    assert set(np.unique(data[costmap.costs == 254])) == {100}
    assert set(np.unique(data[costmap.costs == 253])) == {99}
    assert set(np.unique(data[costmap.costs == 255])) == {-1}
    assert set(np.unique(data[costmap.costs == 0])) == {0}
    between = (costmap.costs > 0) & (costmap.costs < 253)
    assert between.any()
    assert data[between].min() >= 1
    assert data[between].max() <= 98


def test_the_local_costmap_rolls_with_the_robot(bench: Bench, stack: Stack) -> None:
    got = bench.listen(OccupancyGrid, "local_costmap/costmap", LATCHED)
    goal = stack.drive(np.column_stack([np.linspace(0, 1.2, 13), np.zeros(13), np.zeros(13)]))
    bench.until(lambda: goal.done)
    bench.run(1.5)
    assert got[-1].header.frame_id == "odom"
    centre = got[-1].info.origin.position.x + got[-1].info.width * got[-1].info.resolution / 2
    assert centre == pytest.approx(stack.robot.pose.x, abs=0.1)


# planner_server


def test_a_plan_goes_around_an_obstacle_the_scan_shows(bench: Bench, stack: Stack) -> None:
    plans = bench.listen(Path, "plan", 1)
    straight = path_array(stack.plan(2.4, 0.0).result.path)
    assert path_length(straight) == pytest.approx(2.4, abs=0.1)
    stack.room.add_box(1.0, -0.8, 1.2, 0.5)
    bench.run(0.5)
    around = path_array(stack.plan(2.4, 0.0, 0.5).result.path)
    assert 2.5 < path_length(around) < 4.5
    assert np.abs(around[:, 1]).max() > 0.5
    assert around[-1] == pytest.approx([2.4, 0.0, 0.5])
    assert around[0, :2] == pytest.approx(stack.robot.pose[:2], abs=0.02)
    assert np.abs(np.hypot(*np.diff(around[:, :2], axis=0).T)).max() < 0.2
    assert len(plans) == 2


@pytest.mark.parametrize(
    ("goal", "code", "reason"),
    [
        ((1.75, 1.25), 206, "nothing is free within 0.1 m of the goal (1.75, 1.25)"),  # in the pillar
        ((3.0, 0.0), 206, "goal (3.00, 0.00)"),  # in the wall
        ((9.0, 0.0), 204, "(9.00, 0.00) is outside the costmap"),
        ((math.nan, 0.0), 204, "outside the costmap"),
        ((-3.3, 0.0), 206, "goal (-3.30, 0.00)"),  # unknown
    ],
)
def test_an_impossible_goal_is_answered_with_code_and_reason(
    stack: Stack, goal: tuple[float, float], code: int, reason: str
) -> None:
    sent = stack.plan(*goal)
    assert sent.status == GoalStatus.STATUS_ABORTED
    assert sent.result.error_code == code
    assert reason in sent.result.error_msg


def test_a_walled_in_goal_has_no_path(bench: Bench, stack: Stack) -> None:
    stack.room.add_box(1.0, -2.0, 1.2, 2.0)
    bench.run(0.5)
    sent = stack.plan(2.6, -1.0)
    assert sent.result.error_code == 208
    assert "no path from" in sent.result.error_msg


def test_a_given_start_goes_before_the_robots_pose(stack: Stack) -> None:
    path = path_array(stack.plan(1.0, -1.0, start=Pose2(-2.0, -1.0, 0.0)).result.path)
    assert path[0, :2] == pytest.approx([-2.0, -1.0])


def test_without_a_map_there_is_no_plan(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    costmap = CostmapNode(
        bench.bus,
        robot.pose_lookup,
        CostmapNodeConfig(name="global_costmap", frame="map", layers=LAYERS),
    )
    PlannerServerNode(bench.bus, robot.pose_lookup, costmap)
    client = ActionClient(bench.node, ComputePathToPose, "compute_path_to_pose")
    sent = client.send_goal(new(ComputePathToPose.Goal))
    bench.until(lambda: sent.done, 1.0)
    assert "without map" in sent.result.error_msg


def test_a_path_is_no_longer_valid_when_something_stands_on_it(bench: Bench, stack: Stack) -> None:
    path = stack.plan(2.4, 0.0).result.path
    assert stack.is_valid(path)
    stack.room.add_box(1.0, -0.2, 1.2, 0.2)
    bench.run(0.5)
    assert not stack.is_valid(path)
    assert not stack.is_valid(new(Path)), "no path is no valid path"


def test_what_lies_behind_the_robot_does_not_make_a_path_invalid(bench: Bench, stack: Stack) -> None:
    path = stack.plan(-2.4, 0.0).result.path
    stack.room.add_box(1.0, -0.2, 1.2, 0.2)
    backwards = path_msg(np.array([[1.1, 0, math.pi], [0.5, 0, math.pi], [0.0, 0, math.pi]]), "map", 0)
    bench.run(0.5)
    assert stack.is_valid(path)
    assert stack.is_valid(backwards), "only the rest, from the pose nearest to the robot on, counts"


# controller_server


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


def beside_a_box(bench: Bench, reach: float) -> tuple[Stack, Any]:
    """Follow a path around a box that stands before the robot's nose, too near to turn."""
    stack = Stack(bench, failure_tolerance_ns=4_000_000_000, maneuver=ManeuverConfig(reach=reach))
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
