"""What a screen of a graph draws beside what a recording of a run does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.bridge.messages.as_text import message_to_yaml
from twin.periods import next_due, period_of
from twin.recording.channels.belief import BeliefChannel
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.pictures import picture_entity
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
_COLOURS: dict[str, Any] = {
    "rgb8": "RGB",
    "bgr8": "BGR",
    "rgba8": "RGBA",
    "bgra8": "BGRA",
    "mono8": "L",
    "8UC1": "L",
}
_DEPTHS = {"16UC1": (np.uint16, 1000.0), "mono16": (np.uint16, 1000.0), "32FC1": (np.float32, 1.0)}
"""Type of a pixel, and units per metre, by encoding (sensor_msgs/image_encodings.hpp, REP-118)."""


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


class ImageChannel(Channel[Any]):
    """sensor_msgs/Image: colours, grey, or depths; other encodings are not shown."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.entity = picture_entity(topic)
        self._next_ns = 0

    def take(self, sample: Sample[Any]) -> None:
        """Draw an image that is due."""
        period = self.context.images_period
        if period is None or sample.time_ns < self._next_ns:
            return
        image = drawn(sample.message)
        if image is not None:
            self._next_ns = next_due(period, sample.time_ns)
            self.recording.set_time(TIMELINE, duration=np.timedelta64(sample.time_ns, "ns"))
            self.recording.log(self.entity, image)

    def chunks(self, rows: list[Any]) -> tuple[()]:
        """Yield nothing: there are no rows."""
        return ()


def drawn(message: Any) -> rr.Image | rr.DepthImage | None:
    """Return an image message as Rerun has it; None if its encoding or size is not understood."""
    kind, metre = _DEPTHS.get(message.encoding, (np.uint8, 0.0))
    model = _COLOURS.get(message.encoding)
    width = message.width * (len(model) if model and model != "L" else 1)
    row = width * np.dtype(kind).itemsize
    data: NDArray[np.uint8] = np.asarray(message.data, np.uint8)
    if not (metre or model) or message.step < row or len(data) != message.height * message.step or not row:
        return None
    pixels = np.ascontiguousarray(data.reshape(message.height, message.step)[:, :row]).view(kind)
    if message.is_bigendian:
        pixels = pixels.byteswap()
    if metre:
        return rr.DepthImage(pixels.reshape(message.height, message.width), meter=metre)
    shape = (message.height, message.width, -1)[: 2 if model == "L" else 3]
    return rr.Image(pixels.reshape(shape), color_model=model)


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
    "sensor_msgs/msg/Image": ImageChannel,
    "visualization_msgs/msg/Marker": MarkerChannel,
    "visualization_msgs/msg/MarkerArray": MarkerChannel,
}


def kinds_of(frames: Frames, topic: str, msgtype: str) -> list[type[Channel[Any]]]:
    """Return what draws a topic: nothing, one channel, or two."""
    found = (kind_of(frames, topic, msgtype), _MORE.get(msgtype))
    return [kind for kind in found if kind not in (None, BeliefChannel)]  # transforms are no channel's


def _numbers(thing: Any, names: str) -> tuple[float, ...]:
    return tuple(getattr(thing, name) for name in names)
