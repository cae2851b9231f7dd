"""Images as their pixels: colours, grey, depths."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.periods import next_due
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.pictures import picture_entity
from twin.recording.columns import Chunk, row_of, sim_time

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

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
_MOST_PIXELS = 20_000
"""Of the depths that a recording keeps of an image, evenly spread over it."""
_MM, _LONGEST_MM = 1000.0, 65535


class ImageChannel(Channel[tuple[int, rr.Image | rr.DepthImage]]):
    """sensor_msgs/Image: colours, grey, or depths; other encodings are not shown."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.entity = picture_entity(topic)
        self._next_ns = 0

    @property
    def has_images(self) -> bool:
        """Whether any of its images was shown."""
        return self._next_ns > 0

    def take(self, sample: Sample[Any]) -> None:
        """Keep an image that is due."""
        period = self.context.images_period
        if period is None or sample.time_ns < self._next_ns:
            return
        image = self.drawn(sample.message)
        if image is not None:
            self._next_ns = next_due(period, sample.time_ns)
            self.rows.append((sample.time_ns, image))
            if isinstance(image, rr.Image):
                self.context.pictures.add(self.topic)
                self.context.seen_from[self.topic] = sample.message.header.frame_id

    def chunks(self, rows: list[tuple[int, rr.Image | rr.DepthImage]]) -> Iterator[Chunk]:
        """Yield the images."""
        for time_ns, image in rows:
            yield self.entity, sim_time([time_ns]), row_of(image)

    def drawn(self, message: Any) -> rr.Image | rr.DepthImage | None:
        """Return an image message as Rerun has it; None if its encoding or size is not understood."""
        return drawn(message)


class DepthChannel(ImageChannel):
    """sensor_msgs/Image of depths, few of them, in millimetres, so that a recording stays small.

    A view of its own shows them: those of space have the camera's points.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.entity = depth_entity(topic)

    def drawn(self, message: Any) -> rr.DepthImage | None:
        """Return depths; None of any other image."""
        pixels = _pixels(message) if message.encoding in _DEPTHS else None
        if pixels is None:
            return None
        step = math.ceil(math.sqrt(pixels.size / _MOST_PIXELS))
        metres = pixels[step // 2 :: step, step // 2 :: step] / _DEPTHS[message.encoding][1]
        millimetres = np.rint(_MM * np.nan_to_num(metres, posinf=0.0, neginf=0.0))
        millimetres[(millimetres < 0.0) | (millimetres > _LONGEST_MM)] = 0.0
        return rr.DepthImage(millimetres.astype(np.uint16), meter=_MM)


def depth_entity(topic: str) -> str:
    """Return where depths of a topic are: not where the views of space look."""
    return f"/depths{topic}"


def drawn(message: Any) -> rr.Image | rr.DepthImage | None:
    """Return an image message as Rerun has it; None if its encoding or size is not understood."""
    pixels = _pixels(message)
    if pixels is None:
        return None
    if message.encoding in _DEPTHS:
        return rr.DepthImage(pixels, meter=_DEPTHS[message.encoding][1])
    return rr.Image(pixels, color_model=_COLOURS[message.encoding])


def _pixels(message: Any) -> NDArray[Any] | None:
    """Return what an image holds, shape (height, width) or (height, width, channels)."""
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
    return pixels.reshape((message.height, message.width, -1)[: 3 if model not in (None, "L") else 2])
