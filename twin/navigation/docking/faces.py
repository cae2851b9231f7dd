"""What a planar lidar sees of what is in front: the face of a wall or a box to dock at, in the base frame.

Detectors tell where the boxes are that a gripper is to take.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation._jit import jit
from twin.parameters import Metres, Positive

CORNER = 0.02
"""A chain of points that leaves its chord by more than this has a corner [m]."""
_ON_LINE = 0.02
"""Points within this of a line belong to it [m]."""
_MAX_GAP = 0.05
"""Neighbouring points farther apart than this belong to different things [m]."""
_MAX_YAW = math.radians(40.0)
"""A face of a box that is turned away farther than this is not looked at [rad]."""
HYPOTHESIS_POINTS = 40
"""Lines through every pair of so many points are tried."""


@dataclass(frozen=True, kw_only=True)
class WallFit:
    """A wall in front of the robot."""

    distance: float
    """From the base origin, perpendicular to the wall [m]."""
    yaw: float
    """Direction of the perpendicular in the base frame [rad]; 0 when the robot faces the wall squarely."""
    inliers: NDArray[np.bool_]
    """Which points belong to the wall, shape (n,)."""


@dataclass(frozen=True, kw_only=True)
class BoxFace:
    """The face of a box in front of the robot."""

    pose: Pose2
    """Of the face's centre in the base frame, x into the box: yaw 0 when the robot faces it squarely."""
    width: float
    """As measured [m]."""


def fit_wall(
    points: ArrayLike, *, facing: float = 0.0, max_yaw: float = math.pi, min_length: float = 0.0
) -> WallFit | None:
    """Return the line that most points lie on, among lines that may be the wall, or None if there is none.

    Lines through pairs of points are scored by truncated squared distance (MSAC, Torr and Zisserman 2000),
    in a fixed order; then total least squares over the inliers.

    Args:
        points: Shape (n, 2), in the base frame [m].
        facing: Expected direction of the perpendicular in the base frame [rad].
        max_yaw: A line turned further than this against it is another thing [rad].
        min_length: So is a line whose points reach less far along it [m].
    """
    xy = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if len(xy) < 5:
        return None
    line = _best_line(xy, facing, max_yaw)
    if line is None:
        return None
    normal, offset = line
    for _ in range(3):
        inliers = np.abs(xy @ normal - offset) <= _ON_LINE
        if np.count_nonzero(inliers) < 5:
            return None
        normal, offset, _ = _total_least_squares(xy[inliers])
    normal, offset, yaw = _facing(normal, offset)
    reach = float(np.ptp(xy[inliers] @ np.array([-normal[1], normal[0]])))
    if abs(wrap_angle(yaw - facing)) > max_yaw or reach < min_length:
        return None
    return WallFit(distance=offset, yaw=yaw, inliers=inliers)


def _best_line(points: Array, facing: float, max_yaw: float) -> tuple[Array, float] | None:
    """Return unit normal and offset [m] of the line through two points that most lie on; see `fit_wall`."""
    count = min(HYPOTHESIS_POINTS, len(points))
    some = points[np.linspace(0, len(points) - 1, count).astype(np.int64)]
    cost, x, y, offset = _line_of_most(some, float(facing), float(max_yaw))
    return (np.array((x, y)), offset) if cost < math.inf else None


@jit
def _line_of_most(points: Array, facing: float, max_yaw: float) -> tuple[float, float, float, float]:
    """Return the cost of the best line through two points, shape (n, 2), its unit normal, and its offset.

    The cost is inf if no line faces so.
    """
    least, best_x, best_y, best_offset = math.inf, 0.0, 0.0, 0.0
    for i in range(points.shape[0]):
        for j in range(i + 1, points.shape[0]):
            x, y = points[i, 1] - points[j, 1], points[j, 0] - points[i, 0]
            length = math.hypot(x, y)
            if length <= 2.0 * _ON_LINE:
                continue
            x, y = x / length, y / length
            offset = x * points[i, 0] + y * points[i, 1]
            if offset < 0.0:
                x, y, offset = -x, -y, -offset
            turned = (math.atan2(y, x) - facing + math.pi) % (2.0 * math.pi) - math.pi
            if abs(turned) > max_yaw:
                continue
            cost = 0.0
            for k in range(points.shape[0]):
                cost += min((x * points[k, 0] + y * points[k, 1] - offset) ** 2, _ON_LINE**2)
                if cost >= least:
                    break
            if cost < least:
                least, best_x, best_y, best_offset = cost, x, y, offset
    return least, best_x, best_y, best_offset


def find_box_faces(points: ArrayLike, width: float, *, width_tolerance: float = 0.03) -> list[BoxFace]:
    """Return the faces of boxes of known width, that nearest to straight ahead first.

    The scan is cut where neighbours are far apart and at corners; a piece is a face if its width fits.

    Args:
        points: Shape (n, 2), in the base frame, in the order of the beams [m].
        width: Of the face [m].
        width_tolerance: [m].
    """
    xy = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    xy = xy[np.isfinite(xy).all(axis=1)]
    if len(xy) < 5:
        return []
    gaps = np.flatnonzero(np.hypot(*np.diff(xy, axis=0).T) > _MAX_GAP) + 1
    faces = []
    for segment in np.split(xy, gaps):
        for first, last in _split_at_corners(segment, 0, len(segment) - 1):
            face = _face(_grown(segment, first, last), width, width_tolerance)
            if face is not None:
                faces.append(face)
    return sorted(faces, key=lambda face: abs(face.pose.y))


def _total_least_squares(points: Array) -> tuple[Array, float, float]:
    """Return unit normal, offset (normal · x = offset) and rms of the line nearest to the points."""
    centre = points.mean(axis=0)
    values, vectors = np.linalg.eigh((points - centre).T @ (points - centre) / len(points))
    normal: Array = vectors[:, 0]
    return normal, float(normal @ centre), math.sqrt(max(float(values[0]), 0.0))


def _facing(normal: Array, offset: float) -> tuple[Array, float, float]:
    """Return the normal that points away from the robot, its offset, which is positive, and its direction."""
    if offset < 0.0:
        normal, offset = -normal, -offset
    return normal, offset, math.atan2(normal[1], normal[0])


def _split_at_corners(points: Array, first: int, last: int) -> list[tuple[int, int]]:
    """Cut a chain where it leaves its chord by more than `CORNER` (Ramer 1972); return index ranges."""
    chord = points[last] - points[first]
    length = math.hypot(chord[0], chord[1])
    if last - first < 4 or length == 0.0:
        return [(first, last)]
    offset = points[first : last + 1] - points[first]
    away = np.abs(chord[0] * offset[:, 1] - chord[1] * offset[:, 0]) / length
    corner = first + int(np.argmax(away))
    if away.max() <= CORNER:
        return [(first, last)]
    return _split_at_corners(points, first, corner) + _split_at_corners(points, corner, last)


def _grown(points: Array, first: int, last: int) -> Array:
    """Return the run of points that fits the line of points[first..last], which noise may have cut short."""
    if last - first < 4:
        return points[first : last + 1]
    normal, offset, _ = _total_least_squares(points[first : last + 1])
    on_line = np.abs(points @ normal - offset) <= CORNER / 2.0
    middle = (first + last) // 2
    off = np.flatnonzero(~on_line)
    start = int(off[off < middle].max(initial=-1)) + 1
    end = int(off[off > middle].min(initial=len(points)))
    return points[start:end]


def _face(points: Array, width: float, tolerance: float) -> BoxFace | None:
    """Return the face that these points would be, or None if the width or the direction does not fit."""
    if len(points) < 5:
        return None
    normal, offset, rms = _total_least_squares(points)
    normal, offset, yaw = _facing(normal, offset)
    tangent = np.array([-normal[1], normal[0]])
    at = points @ tangent
    low, high = float(at.min()), float(at.max())
    # The edges lie, on average, half a beam outside the first and last point.
    measured = (high - low) * len(points) / (len(points) - 1)
    if abs(measured - width) > tolerance or rms > 0.03 or abs(wrap_angle(yaw)) > _MAX_YAW:
        return None
    centre = offset * normal + 0.5 * (low + high) * tangent
    return BoxFace(pose=Pose2(float(centre[0]), float(centre[1]), yaw), width=measured)


class Detector(ABC):
    """Finds what is to be grasped in one scan."""

    Config: ClassVar[type | None] = None
    """The class of its parameters: a frozen dataclass; None: it has none."""

    def __init__(self, config: Any) -> None:
        """Take an object of its `Config`."""
        self.config = config

    @abstractmethod
    def detect(self, points: Array) -> Sequence[Pose2]:
        """Return the centres of the front faces, that nearest to straight ahead first.

        Args:
            points: Shape (n, 2), in the base frame, in the order of the beams, some NaN [m].

        Returns:
            In the base frame, x into the box.
        """


@dataclass(frozen=True, kw_only=True)
class BoxFacesConfig:
    """What a box looks like."""

    width: Annotated[Metres, Positive] = 0.24
    """Width of its face [m]."""
    width_tolerance: Annotated[Metres, Positive] = 0.035
    """How far a face may be off it [m]."""
    max_x: Annotated[Metres, Positive] = 1.8
    """Points further ahead of the base are not looked at [m]."""
    max_y: Annotated[Metres, Positive] = 0.8
    """Points further aside are not looked at [m]."""


class BoxFaces(Detector):
    """Finds faces of one width."""

    Config = BoxFacesConfig

    def detect(self, points: Array) -> Sequence[Pose2]:
        """Return their centres."""
        config = self.config
        near = (points[:, 0] < config.max_x) & (np.abs(points[:, 1]) < config.max_y)
        if np.count_nonzero(near) < 5:
            return []
        faces = find_box_faces(points[near], config.width, width_tolerance=config.width_tolerance)
        return [face.pose for face in faces]
