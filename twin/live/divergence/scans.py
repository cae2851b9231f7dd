"""What a lidar measures against what a virtual one measures that is nearly at the same place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from twin.geometry import Array, Pose2

_LEAST_PAIRED = 0.2
"""Share of a scan's rays of which the opposite ones have to be known."""


@dataclass(frozen=True, kw_only=True)
class ScanConfig:
    """How much two scans may differ that show the same."""

    tolerance: float = 0.10
    """Of a range [m] ..."""
    share: float = 0.02
    """... and of its length."""
    neighbours: float = 0.05
    """Rays count that are so near [rad]: what they see explains a ray that passes an edge."""
    least_rays: int = 4
    """So many rays side by side are a thing."""


@dataclass(frozen=True, kw_only=True)
class Scan:
    """Of a planar lidar, in its frame."""

    stamp_ns: int
    angle_min: float
    """[rad]"""
    angle_increment: float
    """[rad]"""
    range_max: float
    """[m]"""
    ranges: Array
    """Shape (n,) [m]; as REP-117 says, inf where nothing returns, -inf too near, NaN for no reading."""

    @property
    def angles(self) -> Array:
        """Directions of the rays, shape (n,) [rad]."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Thing:
    """Rays side by side that are not explained."""

    kind: Literal["more", "less"]
    """`more`: something is there that is not expected; `less`: what is expected is not there."""
    x: float
    """Middle of its surface, in the lidar's frame [m]."""
    y: float
    width: float
    """Between its ends [m]."""


@dataclass(frozen=True, kw_only=True)
class ScanMatch:
    """One scan against what was expected of it; shares are of the rays that measured, explained or not."""

    stamp_ns: int
    explained: float
    """Share of rays that end where they are expected to."""
    shorter: float
    longer: float
    residual: float
    """Median of what the explained rays differ [m]."""
    offset: float
    """How much farther than expected rays measure, explained or not: the median over pairs of opposite rays
    of their mean [m]. A place that is a little wrong is nearer on one side and farther on the other; 0 if too
    few are opposite each other."""
    returned: float
    """Share of all rays in which something returned."""
    expected: float
    """Share of all rays in which something was expected to."""
    things: tuple[Thing, ...]


def compare(expected: Scan, measured: Scan, moved: Pose2, config: ScanConfig = ScanConfig()) -> ScanMatch:
    """Compare two scans of which the second was taken `moved` from where the first one was.

    Args:
        expected: By the virtual lidar.
        measured: By the physical one.
        moved: Where the virtual lidar was when the physical one measured, in the frame of `expected`.
        config: How much they may differ.
    """
    longest = min(expected.range_max, measured.range_max)
    returned = np.isfinite(measured.ranges) & (measured.ranges < longest)
    angles, ranges = _seen_from(expected, moved, longest)
    low, middle, high = _between(angles, ranges, measured.angles, config.neighbours)
    actual = np.where(measured.ranges >= longest, longest, measured.ranges)
    known = np.isfinite(actual)
    allowed = config.tolerance + config.share * np.where(known, actual, 0.0)
    with np.errstate(invalid="ignore"):
        shorter, longer = known & (actual < low - allowed), known & (actual > high + allowed)
    count = max(1, int(np.count_nonzero(known)))
    fits = known & returned & ~shorter & ~longer
    beside = np.abs(actual - middle)[fits]
    farther = np.where(known & returned & (middle < longest), actual - middle, math.nan)
    things = [
        *_things("more", shorter, actual, measured.angles, config.least_rays),
        *_things("less", longer, low, measured.angles, config.least_rays),
    ]
    return ScanMatch(
        stamp_ns=measured.stamp_ns,
        explained=1.0 - float(np.count_nonzero(shorter | longer)) / count,
        shorter=float(np.count_nonzero(shorter)) / count,
        longer=float(np.count_nonzero(longer)) / count,
        residual=float(np.median(beside)) if len(beside) else math.nan,
        offset=_offset(farther, measured.angle_increment),
        returned=float(np.mean(returned)),
        expected=float(np.mean(low < longest)),
        things=tuple(things),
    )


def _offset(farther: Array, increment: float) -> float:
    """Return by how much pairs of opposite rays are farther than expected; NaN where that is not known."""
    count = len(farther)
    rays = np.arange(count)
    opposite = np.rint(
        np.mod(math.pi + rays * increment, math.copysign(2.0 * math.pi, increment)) / increment
    )
    paired = opposite < count
    pairs = (farther[rays[paired]] + farther[opposite[paired].astype(np.intp)]) / 2.0
    pairs = pairs[np.isfinite(pairs)]
    return float(np.median(pairs)) if len(pairs) > _LEAST_PAIRED * count else 0.0


def _seen_from(scan: Scan, moved: Pose2, longest: float) -> tuple[Array, Array]:
    """Return directions, rising, and ranges of what a scan shows, from another place."""
    known = ~np.isnan(scan.ranges) & (scan.ranges > 0.0)
    ranges, angles = scan.ranges[known], scan.angles[known]
    far = ~(ranges < longest)
    ends = np.column_stack((np.cos(angles), np.sin(angles))) * np.where(far, longest, ranges)[:, None]
    ends = moved.inverse().apply(ends)
    ranges = np.where(far, longest, np.hypot(ends[:, 0], ends[:, 1]))
    angles = np.arctan2(ends[:, 1], ends[:, 0])
    order = np.argsort(angles)
    return angles[order], ranges[order]


def _between(angles: Array, ranges: Array, wanted: Array, neighbours: float) -> tuple[Array, Array, Array]:
    """Return the least range near each direction, that in it and the largest; NaN where none is."""
    if not len(angles):
        nothing = np.full(len(wanted), math.nan)
        return nothing, nothing, nothing
    # A round trip: once more before and after, so that directions near pi have neighbours.
    turn = 2.0 * math.pi
    angles = np.concatenate([angles - turn, angles, angles + turn])
    ranges = np.concatenate([ranges, ranges, ranges])
    step = turn / max(1, len(ranges) // 3)
    step = min(step, float(np.median(np.diff(angles))))
    reach = max(1, round(neighbours / max(step, 1e-4)))
    wanted = (wanted + math.pi) % turn - math.pi
    near = np.clip(np.searchsorted(angles, wanted), 1, len(angles) - 1)
    near -= wanted - angles[near - 1] < angles[near] - wanted
    low = minimum_filter1d(ranges, 2 * reach + 1, mode="nearest")[near]
    high = maximum_filter1d(ranges, 2 * reach + 1, mode="nearest")[near]
    alone = np.abs(angles[near] - wanted) > neighbours
    found = (low, ranges[near], high)
    low, middle, high = (np.where(alone, math.nan, each) for each in found)
    return low, middle, high


def _things(
    kind: Literal["more", "less"], odd: NDArray[np.bool_], ranges: Array, angles: Array, least: int
) -> list[Thing]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], odd.astype(np.int8), [0]])))
    found = []
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        if end - first < least:
            continue
        # Of a run that a corner divides, the nearest part is the thing.
        nearest = float(np.min(ranges[first:end]))
        mine = first + np.flatnonzero(ranges[first:end] < nearest + 1.0)
        x, y = ranges[mine] * np.cos(angles[mine]), ranges[mine] * np.sin(angles[mine])
        width = math.hypot(float(x[-1] - x[0]), float(y[-1] - y[0]))
        found.append(Thing(kind=kind, x=float(np.median(x)), y=float(np.median(y)), width=width))
    return found
