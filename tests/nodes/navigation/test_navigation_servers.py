"""Map, costmap and planner servers of a robot in a room of walls."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, Room, box, map_of_room, open_room
from tests.nodes.navigation.servers import LAYERS, Stack
from twin.bridge.action_types import ComputePathToPose
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import GoalStatus, OccupancyGrid, Path, new
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import ClearEntireCostmap, GetMap
from twin.geometry import Pose2
from twin.navigation.behavior_trees.paths import length as path_length
from twin.nodes.messages import path_array, path_msg
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.mapping.map_server import MapServerNode, occupancy_map
from twin.nodes.navigation.planning.planner_server import PlannerServerNode


@pytest.fixture
def stack(bench: Bench) -> Stack:
    return Stack(bench)


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


@pytest.mark.parametrize("inf_is_valid", [True, False])
def test_a_ray_without_return_clears_if_inf_is_valid(bench: Bench, inf_is_valid: bool) -> None:
    pillar, crate = box(-2.0, -0.2, -1.8, 0.2), box(1.02, -0.2, 1.2, 0.2)
    room = Room(np.concatenate([pillar, crate]))
    layers = replace(LAYERS, rolling_window=True, track_unknown_space=False, inf_is_valid=inf_is_valid)
    config = CostmapNodeConfig(name="local_costmap", frame="odom", layers=layers)
    node = CostmapNode(bench.bus, Robot(bench, room).pose_lookup, config)
    costs = []
    for seen in (room.segments, pillar):
        room.segments = seen
        bench.run(0.5)
        assert node.costmap is not None
        costs.append(node.costmap.cost_at(1.03, 0.0))
    assert costs == [254, 0 if inf_is_valid else 254]


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
        ((math.nan, 0.0), 204, "is not finite"),
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
