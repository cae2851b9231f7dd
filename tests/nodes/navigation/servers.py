"""The servers that take a robot along a path, on ideal wheels in a room of walls."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge.action_types import ComputePathToPose, FollowPath
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import Path, new
from twin.bridge.srvs import IsPathValid
from twin.geometry import Pose2
from twin.navigation.control.goal_checker import GoalCheckerConfig
from twin.navigation.costmaps.layered_costmap import CostmapConfig
from twin.navigation.planning.config import PlannerConfig
from twin.nodes.messages import path_msg, pose_stamped
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.controller_server.server import ControllerServerNode
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.mapping.map_server import MapServerNode
from twin.nodes.navigation.planning.planner_server import PlannerServerNode

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
        self.controller_server = ControllerServerNode(
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
