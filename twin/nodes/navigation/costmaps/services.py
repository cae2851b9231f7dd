"""The services of a costmap, as Nav2: clear it, as a whole or in part, and ask for its costs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import new
from twin.bridge.node import Node
from twin.bridge.srvs import (
    ClearCostmapAroundPose,
    ClearCostmapAroundRobot,
    ClearCostmapExceptRegion,
    ClearEntireCostmap,
    GetCost,
    GetCostmap,
)
from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import footprint_cost
from twin.navigation.costmaps.layered_costmap import LayeredCostmap
from twin.nodes.navigation.costmaps.messages import costmap_msg
from twin.nodes.navigation.robot_pose import RobotPose


class CostmapServices:
    """`clear_entirely_<name>`, `clear_around_`, `clear_around_pose_`, `clear_except_`, `get_cost_`."""

    def __init__(
        self,
        node: Node,
        name: str,
        frame: str,
        pose: RobotPose,
        layers: Callable[[], LayeredCostmap | None],
        cleared: Callable[[bool], None],
    ) -> None:
        """Create the services.

        Args:
            node: The costmap's.
            name: Of the costmap.
            frame: Of the costmap.
            pose: What the robot believes about its pose.
            layers: The costmap as it is now; None before there is a map.
            cleared: Called after something was forgotten, with whether that was everything.
        """
        self._node, self._frame, self._pose, self._layers = node, frame, pose, layers
        self._cleared = cleared
        node.create_service(ClearEntireCostmap, f"clear_entirely_{name}", self._clear_entirely)
        node.create_service(ClearCostmapAroundRobot, f"clear_around_{name}", self._clear_around)
        node.create_service(ClearCostmapAroundPose, f"clear_around_pose_{name}", self._clear_around_pose)
        node.create_service(ClearCostmapExceptRegion, f"clear_except_{name}", self._clear_except)
        node.create_service(GetCost, f"get_cost_{name}", self._get_cost)
        node.create_service(GetCostmap, "get_costmap", self._get_costmap)

    def _clear_entirely(self, _request: Any) -> Any:
        layers = self._layers()
        if layers is not None:
            layers.clear()
            self._cleared(True)
        return new(ClearEntireCostmap.Response)

    def _clear_around(self, request: Any) -> Any:
        self._clear(self._robot(), request.reset_distance, outside=False)
        return new(ClearCostmapAroundRobot.Response)

    def _clear_except(self, request: Any) -> Any:
        self._clear(self._robot(), request.reset_distance, outside=True)
        return new(ClearCostmapExceptRegion.Response)

    def _clear_around_pose(self, request: Any) -> Any:
        frame = request.pose.header.frame_id
        T: Pose2 | None = Pose2(0.0, 0.0, 0.0)
        if frame and frame != self._frame:
            T = self._pose.relative(self._frame, frame)
        pose = None if T is None else T @ pose2_from_pose(request.pose.pose)
        self._clear(pose, request.reset_distance, outside=False)
        return new(ClearCostmapAroundPose.Response)

    def _robot(self) -> Pose2 | None:
        return self._pose.relative(self._frame, self._pose.frames.base)

    def _clear(self, pose: Pose2 | None, size: float, *, outside: bool) -> None:
        layers = self._layers()
        if layers is None or pose is None:
            self._node.get_logger().error("nothing cleared: there is no map yet, or no transform to the pose")
        elif not all(map(math.isfinite, (*pose, size))):
            self._node.get_logger().error("nothing cleared: the pose or the distance is not finite")
        else:
            layers.clear_area(pose.x, pose.y, float(size), outside=outside)
            self._cleared(False)

    def _get_cost(self, request: Any) -> Any:
        """Answer the cost at a point, or the worst under the footprint's outline; -1 off the costmap."""
        layers = self._layers()
        at = Pose2(float(request.x), float(request.y), float(request.theta))
        if layers is None or not all(map(math.isfinite, at)) or not layers.costmap.contains(at.x, at.y):
            return new(GetCost.Response, cost=-1.0)
        grid, outlined = layers.costmap, request.use_footprint
        cost = footprint_cost(grid, layers.config.polygon, at) if outlined else grid.cost_at(at.x, at.y)
        return new(GetCost.Response, cost=float(cost))

    def _get_costmap(self, _request: Any) -> Any:
        layers = self._layers()
        if layers is None:
            return new(GetCostmap.Response)
        return new(GetCostmap.Response, map=costmap_msg(layers.costmap, self._frame, self._node.now_ns))
