"""Where the face of a dock is: the plan says where to expect it, scans tell where it is.

A measurement counts if it is near what the plan says, not near the estimate so far: otherwise a neighbour's
box could draw the estimate away step by step. Of what counts, the median of the latest few is taken, so that
a single wrong sight changes nothing.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.docking.config import DockEstimateConfig
from twin.navigation.docking.faces import fit_wall


class DockEstimate:
    """The face of one dock, in the odom frame."""

    def __init__(
        self, expected: Pose2, config: DockEstimateConfig, *, wants_box: bool, face_width: float = 0.0
    ) -> None:
        """Begin with what the plan says.

        Args:
            expected: Point on the face, x into the dock, in the odom frame.
            config: What is believed.
            wants_box: Whether to line up with the box there, or with the expected point.
            face_width: Of a face whose middle is to be lined up with [m]; 0: the expected point is.
        """
        self.config = config
        self.wants_box = wants_box
        self.face_width = face_width
        self._expected = expected
        self._walls: deque[tuple[float, float]] = deque(maxlen=config.max_sights)
        self._middles: deque[tuple[float, float]] = deque(maxlen=config.max_sights)
        """What to line up with: boxes, or middles of the face, in the expected dock's frame."""

    @property
    def seen_face(self) -> bool:
        """Whether the face was seen often enough."""
        return len(self._walls) >= self.config.min_sights

    @property
    def seen(self) -> bool:
        """Whether all that is looked for was seen often enough."""
        knows_middle = not self.wants_box and not self.face_width
        return self.seen_face and (knows_middle or len(self._middles) >= self.config.min_sights)

    @property
    def face(self) -> Pose2:
        """The point to dock at, x into the dock, in the odom frame."""
        edge = self._edge()
        if not self._middles:
            return self._expected @ edge
        # The box stands behind the edge: its foot on the face is what the robot lines up with.
        x, y = _medians(self._middles)
        return self._expected @ edge @ Pose2(0.0, (edge.inverse() @ Pose2(x, y, 0.0)).y, 0.0)

    def _edge(self) -> Pose2:
        """Return the point of the face on the expected dock's x axis, in the expected dock's frame."""
        if not self._walls:
            return Pose2(0.0, 0.0, 0.0)
        x, yaw = _medians(self._walls)
        return Pose2(x, 0.0, yaw)

    def take_scan(self, points: Array, T_odom_base: Pose2) -> bool:
        """Look for the face among points, shape (n, 2), in the base frame; return whether it is there."""
        config = self.config
        local = (self.face.inverse() @ T_odom_base).apply(points)
        near = np.abs(local[:, 0]) < config.search_depth
        near &= np.abs(local[:, 1]) < config.search_half_width
        T_expected_base = self._expected.inverse() @ T_odom_base
        wall = fit_wall(
            points[near], facing=-T_expected_base.yaw, max_yaw=config.max_yaw, min_length=config.min_length
        )
        if wall is None:
            return False
        yaw = wrap_angle(wall.yaw + T_expected_base.yaw)
        offset = wall.distance + math.cos(yaw) * T_expected_base.x + math.sin(yaw) * T_expected_base.y
        self._walls.append((offset / math.cos(yaw), yaw))
        if self.face_width:
            self._take_middle(points[near][wall.inliers], wall.yaw, T_expected_base)
        return True

    def _take_middle(self, face: Array, yaw: float, T_expected_base: Pose2) -> None:
        """Note the middle of the face's points, shape (n, 2), in the base frame, if all of it is in sight."""
        aside = face @ np.array([-math.sin(yaw), math.cos(yaw)])
        # The edges lie, on average, half a beam outside the first and last point.
        width = float(np.ptp(aside)) * len(face) / (len(face) - 1)
        if abs(width - self.face_width) > self.config.width_tolerance:
            return
        ends = face[[int(np.argmin(aside)), int(np.argmax(aside))]]
        x, y = T_expected_base.apply(ends).mean(axis=0).tolist()
        if abs(y) <= self.config.box_reach:
            self._middles.append((x, y))

    def take_boxes(self, boxes: Sequence[Pose2], T_odom_base: Pose2) -> bool:
        """Look for the box among faces seen, in the base frame; return whether it is one of them."""
        if not self.wants_box:
            return False
        T_expected_base = self._expected.inverse() @ T_odom_base
        edge, config = self._edge(), self.config
        seen = [T_expected_base @ box for box in boxes]
        there = [t for t in seen if abs(t.x - edge.x) <= config.box_depth and abs(t.y) <= config.box_reach]
        if not there:
            return False
        nearest = min(there, key=lambda box: abs(box.y))
        self._middles.append((nearest.x, nearest.y))
        return True


def _medians(pairs: Iterable[tuple[float, float]]) -> Iterator[float]:
    """Yield the median of each column; for a few numbers numpy takes several times as long."""
    for column in zip(*pairs, strict=True):
        values, middle = sorted(column), len(column) // 2
        yield values[middle] if len(values) % 2 else (values[middle - 1] + values[middle]) / 2.0
