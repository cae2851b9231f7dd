"""Matching a scan with scans whose poses are known: coarse by correlation, fine by alignment with lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.mapping.alignment import Alignment, Lines
from twin.navigation.mapping.correlation import CorrelationGrid, Window
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.uncertainty import inverted

DEVIATION = 0.03
"""Of a point from the line it lies on [m]."""
CORRELATED = 6.0
"""So many points of a scan are as good as one independent one: all of them see the same faults."""
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


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Scans at known poses, ready to be matched with."""

    grid: CorrelationGrid
    lines: Lines

    @staticmethod
    def of(
        scans: Sequence[Scan], poses: Array, *, resolution: float, deviation: float, levels: int
    ) -> Reference | None:
        """Return the reference of scans at poses, shape (n, 3); None if they saw nothing."""
        points, normals = [], []
        for scan, (x, y, yaw) in zip(scans, poses.tolist(), strict=True):
            points.append(Pose2(x, y, yaw).apply(scan.points))
            normals.append(Pose2(0.0, 0.0, yaw).apply(scan.normals))
        merged = np.concatenate(points)
        if not len(merged):
            return None
        halves = np.concatenate([scan.half_lengths for scan in scans])
        return Reference(
            grid=CorrelationGrid(merged, resolution, deviation, levels),
            lines=Lines(merged, np.concatenate(normals), halves),
        )

    def match(self, scan: Scan, guess: Pose2, window: Window, prior: Array, least: float) -> Match | None:
        """Return where `scan` fits, None if it fits nowhere in the window with a response of `least`.

        Args:
            scan: In the frame of its base.
            guess: Where its base is believed to be in the map frame.
            window: How far from there it is looked for.
            prior: Covariance of the guess in the map frame, shape (3, 3).
            least: Response of the correlation below which nothing is found.
        """
        coarse = self.grid.search(scan.points, guess, window, least)
        if coarse is None:
            return None
        information = inverted(prior)
        fine = self.lines.align(
            scan.points, scan.normals, coarse.pose, guess, CORRELATED * information, DEVIATION
        )
        if fine.pose.distance(coarse.pose) > 0.5:
            return None
        return Match(
            pose=fine.pose,
            covariance=_covariance(fine, information),
            response=coarse.response,
            inliers=fine.inliers,
        )


def _covariance(fine: Alignment, prior: Array) -> Array:
    return inverted(fine.information / CORRELATED + prior) + FLOOR


def levels_for(half_width: float, resolution: float) -> int:
    """Return how many levels of a pyramid search a window fastest."""
    return max(1, min(6, math.ceil(math.log2(max(half_width / resolution, 1.0))) - 1))
