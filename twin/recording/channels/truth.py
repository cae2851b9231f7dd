"""Ground truth about what cameras see: labels in their colours, and boxes that need no picture."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twin.periods import next_due
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.detections import BoxChannel
from twin.recording.channels.pictures import BLOB, MEDIA_TYPE, picture_entity
from twin.recording.columns import Chunk, sim_time

if TYPE_CHECKING:
    from twin.bridge.topics import Sample


class LabelChannel(Channel[tuple[int, NDArray[np.uint8]]]):
    """sensor_msgs/Image, `rgb8`, as PNG: of few colours it is small, and each stays what it is."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.entity = picture_entity(topic)
        self._next_ns = 0

    def take(self, sample: Sample[Any]) -> None:
        """Keep an image that is due."""
        from PIL import Image

        period, message = self.context.images_period, sample.message
        if period is None or sample.time_ns < self._next_ns:
            return
        self._next_ns = next_due(period, sample.time_ns)
        pixels = np.asarray(message.data, np.uint8).reshape(message.height, message.width, 3)
        file = BytesIO()
        Image.fromarray(pixels).save(file, "png", compress_level=1)
        self.rows.append((sample.time_ns, np.frombuffer(file.getvalue(), np.uint8)))

    def chunks(self, rows: list[tuple[int, NDArray[np.uint8]]]) -> Iterator[Chunk]:
        """Yield the images."""
        times, files = zip(*rows, strict=True)
        kinds = ["image/png"] * len(files)
        yield self.entity, sim_time(times), (BLOB.column(list(files)), MEDIA_TYPE.column(kinds))


class TrueBoxChannel(BoxChannel):
    """Boxes over pictures that the same frame sees, or by themselves if there are none."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.entity = picture_entity(self.topic)
        self.is_alone = False
        """Whether there was no such picture."""

    def over(self, frame: str) -> list[str]:
        """Return over what they are drawn."""
        topics = super().over(frame)
        self.is_alone = not topics
        return topics or [self.topic]


KINDS: dict[str, type[Any]] = {
    "sensor_msgs/msg/Image": LabelChannel,
    "vision_msgs/msg/Detection2DArray": TrueBoxChannel,
}
"""By type of the messages."""
