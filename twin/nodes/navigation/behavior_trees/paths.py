"""Nav2's leaves that cut and join paths (plugins/action)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from twin.bridge.conversions import pose2_from_pose, quaternion_from_yaw
from twin.bridge.msgs import Path, new
from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.behavior_trees import paths
from twin.navigation.behavior_trees.node import Status
from twin.navigation.behavior_trees.ports import inputs, outputs
from twin.nodes.messages import path_array, pose_stamped
from twin.nodes.navigation.behavior_trees.action_node import NavigatorNode


class TruncatePath(NavigatorNode):
    """Cuts the end of a path off, as far as `distance` from its last pose; the rest looks at that pose."""

    PORTS = (*inputs(input_path="message", distance=("double", 1.0)), *outputs(output_path="message"))

    def tick(self) -> Status:
        """Cut."""
        path = self.get("input_path") or new(Path)
        if not path.poses:
            self.put("output_path", path)
            return Status.SUCCESS
        points = path_array(path)
        away = np.hypot(points[:, 0] - points[-1, 0], points[:, 1] - points[-1, 1])
        count = len(points)
        while count > 2 and away[count - 1] < self.get("distance"):
            count -= 1
        dx, dy = points[-1, :2] - points[count - 1, :2]
        last = path.poses[count - 1]
        turned = replace(last.pose, orientation=quaternion_from_yaw(math.atan2(dy, dx)))
        cut = [*path.poses[: count - 1], replace(last, pose=turned)]
        self.put("output_path", Path(header=path.header, poses=cut))
        return Status.SUCCESS


class TruncatePathLocal(NavigatorNode):
    """Keeps the part of a path that lies around the robot."""

    PORTS = (
        *inputs(input_path="message", distance_forward=("limit", 8.0), distance_backward=("limit", 4.0)),
        *inputs(robot_base_frame="string", global_frame="string", transform_tolerance=("double", 0.2)),
        *inputs(robot_frame="string"),  # what `robot_base_frame` was before Lyrical
        *inputs(pose="message", angular_distance_weight=("double", 0.0)),
        *inputs(max_robot_pose_search_dist=("limit", math.inf)),
        *outputs(output_path="message"),
    )
    _path: Any = None
    _nearest = 0

    def tick(self) -> Status:
        """Cut before and behind the pose nearest to the robot."""
        path = self.get("input_path") or new(Path)
        window = self.get("max_robot_pose_search_dist")
        if math.isinf(window) or path is not self._path:
            self._path, self._nearest = path, 0
        given, base = self.get("pose"), self.get("robot_base_frame") or self.get("robot_frame")
        pose = pose2_from_pose(given.pose) if given else self.context.pose(path.header.frame_id or None, base)
        if pose is None:
            return Status.FAILURE
        if not path.poses:
            self.put("output_path", path)
            return Status.SUCCESS
        points = path_array(path)
        last = len(points) if math.isinf(window) else paths.first_after(points, window, self._nearest)
        self._nearest += int(np.argmin(self._distances(points[self._nearest : last], pose)))
        forward = self.get("distance_forward")
        end = paths.first_after(points, math.inf if forward < 0.0 else forward, self._nearest)
        behind = paths.first_after(points[self._nearest :: -1], self.get("distance_backward"))
        begin = self._nearest + 1 - min(behind, self._nearest + 1)
        self.put("output_path", Path(header=path.header, poses=path.poses[begin:end]))
        return Status.SUCCESS

    def _distances(self, points: Array, pose: Pose2) -> Array:
        turn = np.abs([wrap_angle(yaw - pose.yaw) for yaw in points[:, 2]])
        aside = self.get("angular_distance_weight") * turn
        return np.sqrt((points[:, 0] - pose.x) ** 2 + (points[:, 1] - pose.y) ** 2 + aside**2)


class ConcatenatePaths(NavigatorNode):
    """Puts one path behind another."""

    PORTS = (*inputs(input_path1="message", input_path2="message"), *outputs(output_path="message"))

    def tick(self) -> Status:
        """Join them; fails if both are empty."""
        one, two = (self.get(f"input_path{i}") or new(Path) for i in (1, 2))
        if not one.poses and not two.poses:
            return Status.FAILURE
        header = one.header if one.header.frame_id else two.header
        self.put("output_path", Path(header=header, poses=[*one.poses, *two.poses]))
        return Status.SUCCESS


class GetPoseFromPath(NavigatorNode):
    """Takes one pose of a path; negative indices count from its end."""

    PORTS = (*inputs(path="message", index=("int", 0)), *outputs(pose="message"))

    def tick(self) -> Status:
        """Take it; fails if there is none at the index."""
        path, index = self.get("path") or new(Path), self.get("index")
        if not -len(path.poses) <= index < len(path.poses):
            return Status.FAILURE
        pose = path.poses[index]
        self.put("pose", pose if pose.header.frame_id else replace(pose, header=path.header))
        return Status.SUCCESS


class GetCurrentPose(NavigatorNode):
    """Writes where the robot is."""

    PORTS = (*inputs(global_frame="string", robot_base_frame="string"), *outputs(current_pose="message"))

    def tick(self) -> Status:
        """Look it up; fails while it is not known."""
        frame = self.get("global_frame") or self.context.robot_pose.frames.map
        pose = self.context.pose(frame, self.get("robot_base_frame"))
        if pose is None:
            return Status.FAILURE
        self.put("current_pose", pose_stamped(pose, frame, self.context.node.now_ns))
        return Status.SUCCESS
