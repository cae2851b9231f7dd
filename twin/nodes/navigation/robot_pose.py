"""Where the robot believes to be: the latest transforms, projected to the ground plane."""

from __future__ import annotations

from dataclasses import dataclass

from twin.bridge.msgs import Header, ns
from twin.bridge.tf import TransformBuffer, TransformError
from twin.geometry import Pose2


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
