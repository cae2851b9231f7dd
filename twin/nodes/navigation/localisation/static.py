"""`/static_localisation`: ties `map` to `odom` once, for robots that drive by dead reckoning."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.geometry import Pose2
from twin.nodes.navigation.robot_pose import Frames


class StaticLocalisationNode:
    """Publishes the start pose as the constant transform map → odom."""

    def __init__(self, bus: Bus, frames: Frames, start: Pose2, *, namespace: str = "") -> None:
        self.node = bus.create_node("static_localisation", namespace)
        StaticTransformBroadcaster(self.node).send_transform(
            transform_stamped(frames.map, frames.odom, self.node.now_ns, start)
        )
