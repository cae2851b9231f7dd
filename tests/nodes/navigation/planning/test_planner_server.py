"""Planner and smoother server: planners by name, paths through poses, other ways, cancelling."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge.action_types import ComputePathThroughPoses, ComputePathToPose, SmoothPath
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import GoalStatus, Path, new
from twin.bridge.srvs import IsPathValid
from twin.geometry import Pose2
from twin.navigation.behavior_trees.paths import length as path_length
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.planning.config import ThetaStarConfig
from twin.nodes.messages import path_array, path_msg, pose_stamped
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.mapping.map_server import MapServerNode
from twin.nodes.navigation.planning.config import PlannerServerConfig
from twin.nodes.navigation.planning.planner_server import PlannerServerNode
from twin.nodes.navigation.planning.smoother_server import SmootherServerNode

pytestmark = pytest.mark.xdist_group("planning")

HALF = 0.15
FOOTPRINT = ((HALF, HALF), (-HALF, HALF), (-HALF, -HALF), (HALF, -HALF))


class Servers:
    """A robot in a room with the servers of this module."""

    def __init__(self, bench: Bench, server: PlannerServerConfig | None = None) -> None:
        self.bench, self.room = bench, open_room()
        self.robot = Robot(bench, self.room)
        pose = self.robot.pose_lookup
        MapServerNode(bench.bus, map_of_room())
        layers = CostmapConfig(
            footprint=FOOTPRINT, inflation_radius=0.4, obstacle_max_range=4.0, raytrace_max_range=5.0
        )
        config = CostmapNodeConfig(name="global_costmap", frame="map", layers=layers)
        costmap = CostmapNode(bench.bus, pose, config)
        planner = ThetaStarConfig(tolerance=0.1, allow_unknown=False)
        self.planner = PlannerServerNode(bench.bus, pose, costmap, config=planner, server=server)
        SmootherServerNode(bench.bus, costmap)
        self.to_pose = ActionClient(bench.node, ComputePathToPose, "compute_path_to_pose")
        self.through = ActionClient(bench.node, ComputePathThroughPoses, "compute_path_through_poses")
        self.smoothing = ActionClient(bench.node, SmoothPath, "smooth_path")
        bench.run(1.0)

    def done(self, sent: Any) -> Any:
        self.bench.until(lambda: sent.done, 2.0)
        return sent

    def plan(self, goal: Pose2, frame: str = "map", **request: Any) -> Any:
        message = new(ComputePathToPose.Goal, goal=pose_stamped(goal, frame, 0), **request)
        return self.done(self.to_pose.send_goal(message))

    def plan_through(self, *goals: Pose2, **request: Any) -> Any:
        stamped = [pose_stamped(goal, "map", 0) for goal in goals]
        return self.done(self.through.send_goal(new(ComputePathThroughPoses.Goal, goals=stamped, **request)))

    def smooth(self, path: np.ndarray, **request: Any) -> Any:
        message = new(SmoothPath.Goal, path=path_msg(path, "map", 0), **request)
        return self.done(self.smoothing.send_goal(message))


@pytest.fixture
def servers(bench: Bench) -> Servers:
    return Servers(bench)


@pytest.mark.parametrize("name", ["", "GridBased", "grid_based", "theta_star", "smac_hybrid"])
def test_a_request_names_its_planner(servers: Servers, name: str) -> None:
    goal = Pose2(2.0, -1.0, -0.5)
    path = path_array(servers.plan(goal, planner_id=name).result.path)
    assert path[-1] == pytest.approx(goal)
    direct = servers.robot.pose.distance(goal)
    straight = {"": 1e-2, "GridBased": 1e-2, "theta_star": 1e-2, "grid_based": 0.25, "smac_hybrid": 0.1}
    assert direct <= path_length(path) + 1e-3
    assert path_length(path) < direct + straight[name]


def test_an_unknown_planner_is_answered_with_the_valid_ones(servers: Servers) -> None:
    result = servers.plan(Pose2(2.0, 0.0, 0.0), planner_id="Nav")
    assert (result.status, result.result.error_code) == (GoalStatus.STATUS_ABORTED, 201)
    assert "'Nav' is no planner; valid: GridBased, grid_based" in result.result.error_msg


def test_a_goal_may_be_told_in_another_frame(servers: Servers) -> None:
    ahead = servers.plan(Pose2(1.0, 0.5, 0.0), "base_footprint").result.path
    want = servers.robot.pose @ Pose2(1.0, 0.5, 0.0)
    assert path_array(ahead)[-1, :2] == pytest.approx(want[:2], abs=0.05)
    lost = servers.plan(Pose2(1.0, 0.5, 0.0), "moon").result
    assert lost.error_code == 202
    assert "'moon' has no transform to 'map'" in lost.error_msg


def test_a_path_through_poses_passes_each_of_them(servers: Servers) -> None:
    goals = (Pose2(1.0, 1.0, 0.0), Pose2(2.0, -1.0, 0.0), Pose2(0.0, -1.0, 3.0))
    sent = servers.plan_through(*goals)
    path = path_array(sent.result.path)
    for goal in goals:
        assert np.hypot(*(path[:, :2] - goal[:2]).T).min() < 1e-6
    assert path[-1] == pytest.approx(goals[-1])
    step = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert step.min() > 0.0
    assert step.max() < 0.2


def test_what_is_wrong_with_a_path_through_poses_has_its_own_codes(servers: Servers) -> None:
    assert servers.plan_through().result.error_code == 309
    assert servers.plan_through(Pose2(1.0, 1.0, 0.0), Pose2(9.0, 0.0, 0.0)).result.error_code == 304
    assert servers.plan_through(Pose2(1.0, 1.0, 0.0), planner_id="x").result.error_code == 301


def test_planning_can_be_cancelled(bench: Bench, servers: Servers) -> None:
    stamped = [pose_stamped(Pose2(1.0, 0.1 * i, 0.0), "map", 0) for i in range(9)]
    sent = servers.through.send_goal(new(ComputePathThroughPoses.Goal, goals=stamped))
    bench.run(0.02)
    sent.cancel()
    servers.done(sent)
    assert sent.status == GoalStatus.STATUS_CANCELED


def test_a_goal_asked_again_from_the_same_place_gets_another_way(bench: Bench) -> None:
    servers = Servers(bench, PlannerServerConfig(compute_alternatives=1))
    servers.room.add_box(0.9, -0.5, 1.3, 0.5)
    bench.run(0.5)
    goal = Pose2(2.4, 0.1, 0.0)
    first, second, third = (path_array(servers.plan(goal).result.path) for _ in range(3))
    at = [np.interp(1.1, path[:, 0], path[:, 1]) for path in (first, second, third)]
    assert at[0] * at[1] < 0, "round the other end"
    assert at[2] == pytest.approx(at[0], abs=0.05), "then from the beginning"


def test_the_poses_of_a_path_that_are_blocked_are_told(bench: Bench, servers: Servers) -> None:
    path = np.column_stack([np.linspace(0.0, 2.4, 25), np.zeros(25), np.zeros(25)])
    servers.room.add_box(1.0, -0.1, 1.2, 0.1)
    bench.run(0.5)
    request = new(IsPathValid.Request, path=path_msg(path, "map", 0))
    answer = bench.call(IsPathValid, "is_path_valid", request)
    assert not answer.is_valid
    blocked = path[np.array(answer.invalid_pose_indices), 0]
    assert blocked.min() == pytest.approx(0.9, abs=0.11)
    assert blocked.max() <= 1.4


@pytest.mark.parametrize("name", ["", "simple_smoother", "savitzky_golay"])
def test_the_smoother_server_smooths(servers: Servers, name: str) -> None:
    zigzag = np.column_stack([np.linspace(0.0, 2.0, 41), 0.05 * (np.arange(41) % 2), np.zeros(41)])
    result = servers.smooth(zigzag, smoother_id=name, check_for_collisions=True).result
    smooth = path_array(result.path)
    assert result.was_completed
    assert path_length(smooth) < path_length(zigzag)
    assert smooth[[0, -1], :2] == pytest.approx(zigzag[[0, -1], :2])


def test_what_cannot_be_smoothed_has_its_code(servers: Servers) -> None:
    through_the_wall = np.column_stack([np.linspace(0.0, 3.4, 30), np.zeros(30), np.zeros(30)])
    assert servers.smooth(through_the_wall, check_for_collisions=True).result.error_code == 503
    assert servers.smooth(through_the_wall).result.was_completed
    assert servers.smooth(through_the_wall, smoother_id="none").result.error_code == 501
    assert servers.smooth(through_the_wall[:1]).result.error_code == 505


def test_parameters_change_the_next_plan(bench: Bench, servers: Servers) -> None:
    assert servers.planner.node.get_parameter("GridBased.w_traversal_cost").value == 2.0
    assert isinstance(servers.plan(Pose2(2.0, 0.0, 0.0)).result.path, Path)


@pytest.mark.parametrize("name", ["simple_smoother", "savitzky_golay"])
@pytest.mark.parametrize("check", [False, True])
def test_a_path_that_is_not_finite_is_refused(servers: Servers, name: str, check: bool) -> None:
    path = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.zeros(11)])
    for value in (math.nan, math.inf):
        path[4, 1] = value
        sent = servers.smooth(path, smoother_id=name, check_for_collisions=check)
        assert (sent.status, sent.result.error_code) == (GoalStatus.STATUS_ABORTED, 505)
        assert sent.result.error_msg == "pose 4 of the path is not finite"
        assert not sent.result.was_completed
