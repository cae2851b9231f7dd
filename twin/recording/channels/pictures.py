"""Compressed images: as pictures, and where their camera is if that is known."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from twin.periods import next_due
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.video import Video, columns
from twin.recording.columns import Chunk, Component, sim_time
from twin.recording.mounted import Mounted

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

BLOB, MEDIA_TYPE = (Component(rr.EncodedImage, name) for name in ("blob", "media_type"))
_PLANE_M = 0.3
"""Distance from the camera at which a picture hangs in the view of space [m]."""


def picture_entity(topic: str) -> str:
    """Return where pictures of a topic are: not below `/ros`, which the map's view shows."""
    return f"/cameras{topic}"


def image_frame(topic: str) -> str:
    """Return the recording's name of the plane of pictures that hang in space."""
    return f"image of {topic}"


class PictureChannel(Channel[tuple[int, str, NDArray[np.uint8]]]):
    """sensor_msgs/CompressedImage: JPEG and PNG, at the recording's own rate; no packed depths.

    They are kept as they are, or become a video.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        """Hang the picture before its camera, if the robot has one of that topic."""
        super().__init__(context, namespace, topic)
        self.entity = picture_entity(topic)
        self._next_ns = 0
        context.pictures.add(topic)
        self._video = Video() if context.images == "h264" else None
        if self._video is not None:
            self.recording.log(self.entity, rr.VideoStream(self._video.codec), static=True)
        camera = context.cameras.get(topic)
        if camera is not None:
            self._mount(camera)

    def take(self, sample: Sample[Any]) -> None:
        """Keep a picture that is due."""
        period, message = self.context.images_period, sample.message
        self.context.seen_from[self.topic] = message.header.frame_id
        packed = "compressedDepth" in message.format
        kind = next((kind for kind in ("jpeg", "png") if kind in message.format and not packed), None)
        if period is None or kind is None or sample.time_ns < self._next_ns:
            return
        self._next_ns = next_due(period, sample.time_ns)
        self.rows.append((sample.time_ns, f"image/{kind}", np.array(message.data, np.uint8)))

    def chunks(self, rows: list[tuple[int, str, NDArray[np.uint8]]]) -> Iterator[Chunk]:
        """Yield the pictures."""
        times, kinds, files = zip(*rows, strict=True)
        if self._video is not None:
            frames = list(self._video.frames(times, files))
            if frames:
                yield self.entity, sim_time([frame.time_ns for frame in frames]), columns(frames)
            return
        yield self.entity, sim_time(times), (BLOB.column(list(files)), MEDIA_TYPE.column(list(kinds)))

    def _mount(self, camera: Mounted) -> None:
        lens, pose, place = camera.lens, camera.T_body_optical, f"camera of {self.topic}"
        w, *xyz = pose.quat_wxyz.tolist()
        self.recording.log(
            f"{self.entity}/camera",
            rr.Transform3D(
                translation=pose.xyz,
                quaternion=rr.Quaternion(xyzw=[*xyz, w]),
                parent_frame=camera.body,
                child_frame=place,
            ),
            static=True,
        )
        hang(self.context, self.topic, place, lens.matrix, (lens.width, lens.height))


def hang(context: Context, topic: str, frame: str, k: ArrayLike, size: tuple[int, int]) -> None:
    """Hang the pictures of a topic before a camera.

    Args:
        context: Of the recording.
        topic: Of the pictures.
        frame: The optical frame, by its name in the recording.
        k: The intrinsic matrix, shape (3, 3) [pixels].
        size: Width and height [pixels].
    """
    context.hung.add(topic)
    context.recording.log(
        picture_entity(topic),
        rr.Pinhole(
            image_from_camera=k,
            resolution=size,
            parent_frame=frame,
            child_frame=image_frame(topic),
            image_plane_distance=_PLANE_M,
        ),
        rr.CoordinateFrame(image_frame(topic)),
        static=True,
    )
