"""What was found: outlines with their names over the picture in which it was found, boxes in space."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.bridge.msgs import ns
from twin.periods import next_due
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.pictures import image_frame, picture_entity
from twin.recording.channels.spatial import SpatialChannel
from twin.recording.columns import Chunk, Component, sim_time

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

_COLOUR = (60, 230, 90, 255)
_STRIPS, _LABELS = (Component(rr.LineStrips2D, name) for name in ("strips", "labels"))
_CENTRES, _TURNS, _HALF_SIZES = (
    Component(rr.Boxes3D, name) for name in ("centers", "quaternions", "half_sizes")
)


class Found(NamedTuple):
    """What is shown of a message."""

    time_ns: int
    picture: str
    """Topic of the picture."""
    outlines: tuple[NDArray[np.float32], ...]
    """Closed, each of shape (n, 2) [pixels]."""
    names: tuple[str, ...]


class DetectionChannel(Channel[Found]):
    """A message about a picture of a camera of the same robot, at the rate of the recording's pictures."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._next_ns = 0
        self._declared: set[str] = set()

    def take(self, sample: Sample[Any]) -> None:
        """Keep what was found in a picture that is kept."""
        message, period = sample.message, self.context.images_period
        stamp_ns = ns(message.header.stamp)
        if period is None or stamp_ns < self._next_ns:
            return
        self._next_ns = next_due(period, stamp_ns)
        found = [self.outline(each) for each in message.detections]
        outlines = tuple(np.concatenate((points, points[:1])).astype(np.float32) for points, _ in found)
        names = tuple(name for _, name in found)
        for topic in self.over(message.header.frame_id):
            self.rows.append(Found(sample.time_ns, topic, outlines, names))

    def over(self, frame: str) -> list[str]:
        """Return topics of pictures that a frame sees, of the same robot."""
        seen, split = self.context.seen_from, self.context.frames.split
        return [topic for topic in seen if seen[topic] == frame and split(topic)[0] == self.namespace]

    @abstractmethod
    def outline(self, detection: Any) -> tuple[NDArray[np.float64], str]:
        """Return corners of what was found, shape (n, 2) [pixels], and what it is called."""

    def chunks(self, rows: list[Found]) -> Iterator[Chunk]:
        """Yield the outlines, camera by camera."""
        for topic in sorted({row.picture for row in rows}):
            seen = [row for row in rows if row.picture == topic]
            entity = f"{picture_entity(topic)}{'' if topic == self.topic else self.topic}"
            if topic not in self._declared:
                self._declared.add(topic)
                look = rr.LineStrips2D.from_fields(
                    colors=[_COLOUR], radii=rr.Radius.ui_points(1.5), show_labels=True
                )
                self.recording.log(entity, look, static=True)
                if topic in self.context.hung:
                    self.recording.log(entity, rr.CoordinateFrame(image_frame(topic)), static=True)
            lengths = [len(row.outlines) for row in seen]
            columns = (
                _STRIPS.column([outline for row in seen for outline in row.outlines], lengths),
                _LABELS.column([name for row in seen for name in row.names], lengths),
            )
            yield entity, sim_time([row.time_ns for row in seen]), columns


class TagChannel(DetectionChannel):
    """apriltag_msgs/AprilTagDetectionArray: borders of tags."""

    def outline(self, detection: Any) -> tuple[NDArray[np.float64], str]:
        """Return the corners of a tag, and its family and id."""
        corners = np.array([(corner.x, corner.y) for corner in detection.corners])
        return corners, f"{detection.family}:{detection.id}"


class BoxChannel(DetectionChannel):
    """vision_msgs/Detection2DArray: boxes around what is seen."""

    def outline(self, detection: Any) -> tuple[NDArray[np.float64], str]:
        """Return the corners of a box, and what is likeliest in it."""
        box, results = detection.bbox, detection.results
        at, turn = box.center.position, box.center.theta
        half = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * (box.size_x, box.size_y) / 2.0
        turned = half @ np.array([(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))])
        likeliest = max(results, key=lambda result: result.hypothesis.score, default=None)
        kind = "" if likeliest is None else likeliest.hypothesis.class_id
        return np.add(turned, (at.x, at.y)), detection.id or kind


class Solids(NamedTuple):
    """What is shown of boxes in space."""

    centres: NDArray[np.float32]
    """Shape (n, 3) [m]."""
    quats_xyzw: NDArray[np.float32]
    """Shape (n, 4)."""
    sizes: NDArray[np.float32]
    """Shape (n, 3) [m]."""


class SolidChannel(SpatialChannel[Solids]):
    """vision_msgs/Detection3DArray as outlines of boxes."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.declare(rr.Boxes3D.from_fields(colors=[_COLOUR], radii=rr.Radius.ui_points(1.5)))

    def take(self, sample: Sample[Any]) -> None:
        """Keep the boxes."""
        boxes = [each.bbox for each in sample.message.detections]
        at = [(p.x, p.y, p.z) for p in (box.center.position for box in boxes)]
        turns = [(q.x, q.y, q.z, q.w) for q in (box.center.orientation for box in boxes)]
        sizes = [(box.size.x, box.size.y, box.size.z) for box in boxes]
        columns = zip((at, turns, sizes), (3, 4, 3), strict=True)
        self.put(sample, Solids(*(np.array(rows, np.float32).reshape(-1, n) for rows, n in columns)))

    def draw(self, rows: list[tuple[int, Solids]]) -> Iterator[Chunk]:
        """Yield the boxes."""
        times, found = zip(*rows, strict=True)
        lengths = [len(each.centres) for each in found]
        centres, turns, sizes = (np.concatenate(rows) for rows in zip(*found, strict=True))
        columns = (
            _CENTRES.column(centres, lengths),
            _TURNS.column(turns, lengths),
            _HALF_SIZES.column(sizes / 2.0, lengths),
        )
        yield self.entity, sim_time(times), columns
