"""What a screen of a graph draws beside what a recording of a run does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from twin.bridge.messages.as_text import message_to_yaml
from twin.periods import next_due, period_of
from twin.recording.channels.belief import BeliefChannel
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.images import DepthChannel, ImageChannel
from twin.recording.channels.pictures import hang
from twin.recording.channels.spatial import Floats, PathChannel, PoseArrayChannel
from twin.recording.channels.table import kind_of
from twin.recording.columns import TIMELINE
from twin.recording.frames import Frames
from twin.recording.watch.markers import MarkerChannel

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

TEXT = "/messages"
"""Where messages that can only be read are."""
_TEXT_HZ = 2.0
_LONGEST = 40
"""Of arrays and texts in what is read."""


class PoseChannel(PoseArrayChannel):
    """A pose with a header, such as PoseStamped, PoseWithCovarianceStamped and Odometry, as an arrow."""

    def take(self, sample: Sample[Any]) -> None:
        """Keep the pose."""
        pose = sample.message.pose
        pose = getattr(pose, "pose", pose)
        p, q = pose.position, pose.orientation
        self.put(sample, np.array([(p.x, p.y, p.z, q.x, q.y, q.z, q.w)]))


class ParticleChannel(PoseArrayChannel):
    """nav2_msgs/ParticleCloud as short arrows."""

    def take(self, sample: Sample[Any]) -> None:
        """Keep at most `max_particles`, evenly spread over the cloud."""
        particles = sample.message.particles
        poses = [each.pose for each in particles[:: -(-len(particles) // self.context.max_particles) or 1]]
        told = [(*_numbers(pose.position, "xyz"), *_numbers(pose.orientation, "xyzw")) for pose in poses]
        self.put(sample, np.array(told, dtype=np.float64).reshape(-1, 7))


class PolygonChannel(PathChannel):
    """geometry_msgs/PolygonStamped, such as a footprint, as its outline."""

    def take(self, sample: Sample[Any]) -> None:
        """Keep the corners, the first one again at the end."""
        corners = [_numbers(point, "xyz") for point in sample.message.polygon.points]
        outline: Floats = np.array([*corners, *corners[:1]], dtype=np.float32).reshape(-1, 3)
        self.put(sample, outline)


class CameraInfoChannel(Channel[Any]):
    """sensor_msgs/CameraInfo: hangs the pictures of the topics beside it in space, before their camera."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._hung: dict[str, tuple[Any, ...]] = {}
        """By topic of pictures: how."""

    def take(self, sample: Sample[Any]) -> None:
        """Hang what does not hang so yet; a camera that is not calibrated has a K of zeros."""
        info = sample.message
        k = np.asarray(info.k, dtype=np.float64)
        if not (np.isfinite(k).all() and k[0] > 0.0 and k[4] > 0.0 and info.width and info.height):
            return
        frame = self.context.frames.belief(self.namespace, info.header.frame_id)
        how = (frame, *k.tolist(), info.width, info.height)
        for topic in sorted(self.context.pictures):
            beside = topic.removesuffix("/compressed").rpartition("/")[0] == self.topic.rpartition("/")[0]
            if beside and self._hung.get(topic) != how:
                self._hung[topic] = how
                hang(self.context, topic, frame, k.reshape(3, 3), (info.width, info.height))

    def chunks(self, rows: list[Any]) -> tuple[()]:
        """Yield nothing: there are no rows."""
        return ()


class TextChannel(Channel[Any]):
    """Any message as YAML to read, as it was last."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._period = period_of(_TEXT_HZ)
        self._next_ns = 0

    def take(self, sample: Sample[Any]) -> None:
        """Write a message that is due."""
        if sample.time_ns < self._next_ns:
            return
        self._next_ns = next_due(self._period, sample.time_ns)
        text = message_to_yaml(sample.message, truncate_length=_LONGEST)
        self.recording.set_time(TIMELINE, duration=np.timedelta64(sample.time_ns, "ns"))
        self.recording.log(f"{TEXT}{self.topic}", rr.TextDocument(text))

    def chunks(self, rows: list[Any]) -> tuple[()]:
        """Yield nothing: there are no rows."""
        return ()


_MORE: dict[str, type[Channel[Any]]] = {
    "geometry_msgs/msg/PolygonStamped": PolygonChannel,
    "geometry_msgs/msg/PoseStamped": PoseChannel,
    "geometry_msgs/msg/PoseWithCovarianceStamped": PoseChannel,
    "nav2_msgs/msg/ParticleCloud": ParticleChannel,
    "nav_msgs/msg/Odometry": PoseChannel,
    "sensor_msgs/msg/CameraInfo": CameraInfoChannel,
    "sensor_msgs/msg/Image": ImageChannel,
    "visualization_msgs/msg/Marker": MarkerChannel,
    "visualization_msgs/msg/MarkerArray": MarkerChannel,
}


def kinds_of(frames: Frames, topic: str, msgtype: str) -> list[type[Channel[Any]]]:
    """Return what draws a topic: nothing, one channel, or two."""
    found = (kind_of(frames, topic, msgtype), _MORE.get(msgtype))
    # Transforms are no channel's, and images are shown whole.
    return [kind for kind in found if kind not in (None, BeliefChannel, DepthChannel)]


def _numbers(thing: Any, names: str) -> tuple[float, ...]:
    return tuple(getattr(thing, name) for name in names)
