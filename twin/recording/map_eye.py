"""The eye that looks at the map from straight above."""

from __future__ import annotations

import rerun as rr

from twin.geometry import Array
from twin.recording.frames import WORLD

MAP_EYE = "/map_eye"
MAP_IMAGE = "image of the map"
"""Frame of what the eye sees."""
_EYE = "eye of the map"
_MARGIN = 0.3
"""Around the floor shown [m]."""
_HEIGHT = 6.0
"""Of the eye, relative to the size of the floor: what is h above it is drawn at most h / 8 farther out. From
nearby a scan would seem to lie outside of the walls; from farther away, depths would be too rough."""
_PIXELS_PER_M = 100.0


def declare_map_eye(recording: rr.RecordingStream, low: Array, high: Array) -> None:
    """Log the eye whose image is the rectangle between two corners (x, y) [m], with north up."""
    width, length = (float(edge) for edge in high - low + 2.0 * _MARGIN)
    height = _HEIGHT * max(width, length)
    recording.log(
        MAP_EYE,
        rr.Transform3D(translation=(*((low + high) / 2.0), height), parent_frame=WORLD, child_frame=_EYE),
        rr.Pinhole(
            focal_length=_PIXELS_PER_M * height,
            resolution=(_PIXELS_PER_M * width, _PIXELS_PER_M * length),
            camera_xyz=rr.ViewCoordinates.RUB,
            parent_frame=_EYE,
            child_frame=MAP_IMAGE,
        ),
        rr.CoordinateFrame(MAP_IMAGE),
        static=True,
    )
