"""Matching a scan with scans whose poses are known: coarse by correlation, fine by alignment with lines.

And whether scans at their poses contradict each other: a beam does not pass through what another has hit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit
from twin.navigation.mapping.alignment import Lines
from twin.navigation.mapping.correlation import Correlation, CorrelationGrid, Window
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.uncertainty import inverted

DEVIATION = 0.03
"""Of a point from the line it lies on [m]."""
CORRELATED = 6.0
"""So many points of a scan are as good as one independent one: all of them see the same faults."""
RIVAL = 0.8
"""What responds less than this part of the best is no rival."""
FLOOR = np.diag([0.004**2, 0.004**2, 0.0015**2])
"""No match is better than this: variances of x, y [m^2], yaw [rad^2]."""


@dataclass(frozen=True, kw_only=True)
class Match:
    """Where a scan fits."""

    pose: Pose2
    """Of the base in the map frame."""
    covariance: Array
    """Of x, y, yaw in the map frame, shape (3, 3)."""
    response: float
    """Of the correlation, 0..1."""
    inliers: float
    """Part of the points that lie on lines of the reference, 0..1."""
    contradicted: float
    """Part of the points that beams have passed, 0..1; see `visibility`."""

    @property
    def score(self) -> float:
        """How well the scan fits, -1..1."""
        return self.inliers - self.contradicted


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Scans at known poses, ready to be matched with."""

    grid: CorrelationGrid
    lines: Lines
    scans: Sequence[Scan]
    poses: Sequence[Pose2]

    @staticmethod
    def of(
        scans: Sequence[Scan], poses: Array, *, resolution: float, deviation: float, levels: int
    ) -> Reference | None:
        """Return the reference of scans at poses, shape (n, 3); None if they saw nothing."""
        places = [Pose2(x, y, yaw) for x, y, yaw in poses.tolist()]
        points = [place.apply(scan.points) for scan, place in zip(scans, places, strict=True)]
        turns = [Pose2(0.0, 0.0, place.yaw) for place in places]
        normals = [turn.apply(scan.normals) for scan, turn in zip(scans, turns, strict=True)]
        merged = np.concatenate(points)
        if not len(merged):
            return None
        halves = np.concatenate([scan.half_lengths for scan in scans])
        return Reference(
            grid=CorrelationGrid(merged, resolution, deviation, levels),
            lines=Lines(merged, np.concatenate(normals), halves),
            scans=scans,
            poses=places,
        )

    def match(self, scan: Scan, guess: Pose2, window: Window, prior: Array, least: float) -> Match | None:
        """Return where `scan` fits, None if it fits nowhere in the window with a response of `least`.

        Args:
            scan: In the frame of its base.
            guess: Of the pose of its base in the map frame, as odometry tells it.
            window: How far from the guess it is looked for.
            prior: Covariance of what is believed in the map frame, shape (3, 3).
            least: Response of the correlation below which nothing is found.
        """
        coarse = self.grid.search(scan.points, guess, window, least)
        return None if coarse is None else self.refined(scan, coarse, guess, prior)

    def rival(self, scan: Scan, match: Match, guess: Pose2, window: Window, prior: Array) -> Match | None:
        """Return where else `scan` fits best; None: nowhere nearly as well. See `match`."""
        least = RIVAL * match.response
        coarse = self.grid.search(scan.points, guess, window, least, match.pose)
        return None if coarse is None else self.refined(scan, coarse, guess, prior)

    def candidates(
        self, scan: Scan, guess: Pose2, window: Window, least: float, sectors: int
    ) -> list[Correlation]:
        """Return what responds most in each of `sectors` parts of the window's angle; see `match`.

        What responds most on the smeared grid need not be what fits best; this asks for several.
        """
        width = 2.0 * window.half_angle / sectors
        narrow = replace(window, half_angle=0.5 * width)
        found = []
        for sector in range(sectors):
            yaw = guess.yaw + (sector + 0.5) * width - window.half_angle
            coarse = self.grid.search(scan.points, Pose2(guess.x, guess.y, yaw), narrow, least)
            if coarse is not None:
                found.append(coarse)
        return found

    def refined(self, scan: Scan, coarse: Correlation, believed: Pose2, prior: Array) -> Match | None:
        """Return the match that alignment leads to from `coarse`; None if it leads far away. See `match`."""
        information = inverted(prior)
        fine = self.lines.align(
            scan.points, scan.normals, coarse.pose, believed, CORRELATED * information, DEVIATION
        )
        if fine.pose.distance(coarse.pose) > 0.5:
            return None
        return Match(
            pose=fine.pose,
            covariance=inverted(fine.information / CORRELATED + information) + FLOOR,
            response=coarse.response,
            inliers=fine.inliers,
            contradicted=contradicted(scan, fine.pose, self.scans, self.poses),
        )

    def best(self, scan: Scan, coarse: Sequence[Correlation], believed: Pose2, prior: Array) -> Match | None:
        """Return the match of the best score that alignment leads to; see `refined`."""
        matches = [self.refined(scan, candidate, believed, prior) for candidate in coarse]
        return max((match for match in matches if match is not None), key=attrgetter("score"), default=None)


def levels_for(half_width: float, resolution: float) -> int:
    """Return how many levels of a pyramid search a window fastest."""
    return max(1, min(6, math.ceil(math.log2(max(half_width / resolution, 1.0))) - 1))


MARGIN = 0.25
"""A point this far in front of where a beam has ended was passed by it [m] ..."""
SLANT = 0.03
"""... plus so much per metre of range: far walls are seen at a slant."""


def contradicted(scan: Scan, pose: Pose2, others: Sequence[Scan], poses: Sequence[Pose2]) -> float:
    """Return the part of points that beams have passed, 0..1: of `scan` by others', of others' by its own.

    Args:
        scan: At `pose`.
        pose: Of its base in the map frame.
        others: At `poses`.
        poses: Of their bases in the map frame, one each.
    """
    if not len(scan):
        return 0.0
    points = pose.apply(scan.points)
    lidar = pose @ scan.sensor
    passed = np.zeros(len(points), dtype=np.bool_)
    seen = through = 0
    for other, place in zip(others, poses, strict=True):
        passed |= _passed(points, np.array(place @ other.sensor), other.angles, other.ranges)[0]
        wrong, in_view = _passed(place.apply(other.points), np.array(lidar), scan.angles, scan.ranges)
        seen += int(in_view.sum())
        through += int(wrong.sum())
    return max(float(passed.mean()), through / max(seen, len(scan)))


@jit
def _passed(
    points: Array, lidar: Array, angles: Array, ranges: Array
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return for points, shape (n, 2), whether the lidar's beams pass them, and whether they reach them."""
    count = points.shape[0]
    passed = np.zeros(count, dtype=np.bool_)
    in_view = np.zeros(count, dtype=np.bool_)
    beams = angles.shape[0]
    if beams < 3:
        return passed, in_view
    step = (angles[beams - 1] - angles[0]) / (beams - 1)
    for n in range(count):
        dx, dy = points[n, 0] - lidar[0], points[n, 1] - lidar[1]
        distance = math.hypot(dx, dy)
        bearing = math.atan2(dy, dx) - lidar[2] - angles[0]
        if step < 0.0:
            bearing = -bearing
        bearing -= 2.0 * math.pi * math.floor(bearing / (2.0 * math.pi))
        beam = math.floor(bearing / abs(step) + 0.5)
        if beam < 1 or beam > beams - 2:
            continue
        # The shortest of three: beside an edge the next beam may pass it.
        shortest = min(ranges[beam - 1], ranges[beam], ranges[beam + 1])
        if not math.isfinite(shortest):
            continue
        in_view[n] = distance < shortest + MARGIN
        passed[n] = distance < (1.0 - SLANT) * shortest - MARGIN
    return passed, in_view
