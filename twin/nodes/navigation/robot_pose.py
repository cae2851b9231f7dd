"""Where the robot believes to be: the latest transforms, projected to the ground plane."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.bridge.msgs import Header, Path, ns
from twin.bridge.services.future import Future
from twin.bridge.tf import TransformBuffer, TransformError
from twin.geometry import Array, Pose2, Pose3
from twin.nodes.messages import path_array

_MOST_EARLY = 5
"""So many messages of a topic wait for odometry; the oldest gives way."""


@dataclass(frozen=True, kw_only=True)
class Frames:
    """REP-105 frame names of one robot."""

    map: str = "map"
    odom: str = "odom"
    base: str = "base_footprint"


class RobotPose:
    """Looks the robot's planar pose up in its transform buffer."""

    def __init__(self, buffer: TransformBuffer, frames: Frames) -> None:
        self.buffer = buffer
        self.frames = frames

    def in_map(self) -> Pose2 | None:
        """Return the latest pose in the map frame, None while the robot is not localised."""
        return self.relative(self.frames.map, self.frames.base)

    def in_odom(self) -> Pose2 | None:
        """Return the latest pose in the odometry frame, None before the first odometry."""
        return self.relative(self.frames.odom, self.frames.base)

    def relative(self, target: str, source: str, time_ns: int | None = None) -> Pose2 | None:
        """Return the planar pose of `source` in `target`, None where the tree does not connect them."""
        try:
            return self.buffer.lookup_planar(target, source, time_ns)
        except TransformError:
            return None

    def at_stamp(self, target: str, header: Header) -> Pose2 | None:
        """Return the planar pose, in `target`, of the frame that a message was measured in, when it was."""
        return self.relative(target, header.frame_id, ns(header.stamp))

    def place_at_stamp(self, target: str, header: Header) -> Pose3 | None:
        """Return, as `at_stamp`, the whole pose: of what looks down or hangs high."""
        try:
            return self.buffer.lookup(target, header.frame_id, ns(header.stamp))
        except TransformError:
            return None

    def placed(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a callback that waits until odometry tells where a message was measured.

        Messages of other processes may come before the transforms that they need, even those of one robot:
        what tf2_ros::MessageFilter is for.
        """
        early: deque[Future] = deque()

        def on_message(message: Any) -> None:
            frame, stamp_ns = message.header.frame_id, ns(message.header.stamp)
            try:
                latest_ns = self.buffer.lookup_stamped(self.frames.odom, frame)[1]
            except TransformError:
                latest_ns = stamp_ns
            if stamp_ns <= latest_ns:
                callback(message)
                return
            placed = self.buffer.waiting.add(self.frames.odom, frame, stamp_ns, None)
            placed.add_done_callback(lambda done: callback(message) if done.error is None else None)
            early.append(placed)
            if len(early) > _MOST_EARLY:
                early.popleft().cancel()

        return on_message

    def path_in_map(self, message: Path) -> Array | None:
        """Return a path as x, y, yaw in the map frame, shape (n, 3); None if its frame has no transform."""
        path, frame = path_array(message), message.header.frame_id
        if frame in ("", self.frames.map) or not len(path):
            return path
        T_map_frame = self.relative(self.frames.map, frame)
        if T_map_frame is None:
            return None
        return np.array([T_map_frame @ Pose2(*pose) for pose in path.tolist()])
