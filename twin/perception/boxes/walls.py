"""Columns of a picture joined into upright faces: cut at jumps, at corners, and where the colour changes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twin.geometry import Array
from twin.perception.boxes.columns import Columns, Index, Mask
from twin.perception.boxes.picture import LevelView

_LEAST_COLUMNS = 4
_GAP = 3
"""Columns in which nothing stands part things that are wider apart."""
_COLOUR_STEP = 14.0
"""Colours on both sides of an edge differ by more than this, of 255 ..."""
_SEAM = 0.85
"""... in more than this share of the rows: labels are not as high as what they are on."""
_WINDOW = 3
"""Columns whose mean is a side's colour."""
_NARROW = 0.06
"""A narrower part at an end of a face is no thing [m]."""
_STRIPE = 0.08
"""What is narrower, between two parts of one colour, is a tape across a thing [m]."""


@dataclass(frozen=True, kw_only=True)
class Wall:
    """An upright plane, from above a line: `normal · (x, y) == offset`."""

    columns: Index
    """Those that lie on it."""
    normal: Array
    """Unit vector away from the eye, shape (2,)."""
    offset: float
    """[m]"""
    rms: float
    """Distance of the columns from it [m]."""

    @property
    def yaw(self) -> float:
        """Direction of the normal [rad]; 0 of what is faced squarely."""
        return math.atan2(self.normal[1], self.normal[0])

    def meets(self, aside: float) -> Array:
        """Return where the ray of a column, -y / x, meets it, shape (2,)."""
        x = self.offset / (self.normal[0] - self.normal[1] * aside)
        return np.array((x, -aside * x))


def find_walls(view: LevelView, columns: Columns, *, by_colour: bool) -> list[Wall]:
    """Return the upright faces from left to right."""
    seen = np.flatnonzero(np.isfinite(columns.x))
    walls = []
    for run in np.split(seen, np.flatnonzero(np.diff(seen) > _GAP) + 1):
        for part in _parts(view, columns, run):
            for piece in _cut_by_colour(view, columns, part) if by_colour else [part]:
                wall = _wall(view, columns, piece)
                if wall is not None:
                    walls.append(wall)
    return walls


def _points(view: LevelView, columns: Columns, run: Index) -> Array:
    x = columns.x[run]
    return np.column_stack((x, -view.aside[run] * x))


def _off(x: float) -> float:
    """Return how far a column's median may be off its face at a distance [m]."""
    return 0.003 + 0.004 * x * x


def _parts(view: LevelView, columns: Columns, run: Index) -> list[Index]:
    """Cut a run at its corners and jumps (Ramer 1972), and join what is straight after all."""
    if len(run) < _LEAST_COLUMNS:
        return []
    points = _points(view, columns, run)
    ends = list(_corners(points, 0, len(points) - 1))
    parts: list[Index] = []
    for first, last in ends:
        part = run[first : last + 1]
        if parts:
            both = np.union1d(parts[-1], part)
            if _residual(_points(view, columns, both)) < _off(float(np.median(columns.x[both]))):
                parts[-1] = both
                continue
        parts.append(part)
    return parts


def _corners(points: Array, first: int, last: int) -> Iterator[tuple[int, int]]:
    chord = points[last] - points[first]
    length = math.hypot(*chord)
    if last - first < _LEAST_COLUMNS or length == 0.0:
        yield first, last
        return
    off = points[first : last + 1] - points[first]
    away = np.abs(chord[0] * off[:, 1] - chord[1] * off[:, 0]) / length
    corner = first + int(np.argmax(away))
    if away.max() <= _off(float(np.median(points[first : last + 1, 0]))):
        yield first, last
        return
    yield from _corners(points, first, corner)
    yield from _corners(points, corner, last)


def _line(points: Array) -> tuple[Array, float]:
    """Return unit normal, away from the origin, and offset of the line nearest to points."""
    centre = points.mean(axis=0)
    normal: Array = np.linalg.eigh((points - centre).T @ (points - centre))[1][:, 0]
    offset = float(normal @ centre)
    return (normal, offset) if offset >= 0.0 else (-normal, -offset)


def _residual(points: Array) -> float:
    normal, offset = _line(points)
    return float(np.abs(points @ normal - offset).max())


def _wall(view: LevelView, columns: Columns, part: Index) -> Wall | None:
    """Return the plane of a part, without what noise or a corner has added at its ends."""
    if len(part) < _LEAST_COLUMNS:
        return None
    points = _points(view, columns, part)
    trim = min(2, (len(part) - _LEAST_COLUMNS) // 2)
    kept = np.zeros(len(part), bool)
    kept[trim : len(part) - trim] = True
    for _ in range(3):
        normal, offset = _line(points[kept])
        off = np.abs(points @ normal - offset)
        kept = off < max(0.6 * _off(float(np.median(points[:, 0]))), 2.5 * float(np.median(off)))
        if np.count_nonzero(kept) < _LEAST_COLUMNS:
            return None
    if not normal[0] > 1e-3:
        return None
    rms = float(np.sqrt(np.mean(off[kept] ** 2)))
    return Wall(columns=part[kept], normal=normal, offset=offset, rms=rms)


def _cut_by_colour(view: LevelView, columns: Columns, part: Index) -> list[Index]:
    """Cut a face where its colour changes from foot to top; a tape across one thing is no such place."""
    if view.colours is None or len(part) < 2 * _LEAST_COLUMNS:
        return [part]
    first, last = int(part[0]), int(part[-1])
    face = columns.face[:, first : last + 1]
    rows = face.any(axis=1)
    face, seen = face[rows], view.colours[rows, first : last + 1]
    span = np.arange(_WINDOW - 1, face.shape[1] - _WINDOW)
    left = np.mean([seen[:, span - i] for i in range(_WINDOW)], axis=0)
    right = np.mean([seen[:, span + 1 + i] for i in range(_WINDOW)], axis=0)
    both = face[:, span] & face[:, span + 1]
    step = np.linalg.norm(right - left, axis=-1)
    share = (both & (step > _COLOUR_STEP)).sum(axis=0) / np.maximum(both.sum(axis=0), 1)
    strength = np.where(share > _SEAM, (step * both).sum(axis=0), 0.0)
    seams: list[int] = []
    for i in np.argsort(-strength, kind="stable"):
        if strength[i] > 0.0 and all(abs(int(span[i]) - seam) > _WINDOW for seam in seams):
            seams.append(int(span[i]))
    bounds = [0, *(seam + 1 for seam in sorted(seams)), face.shape[1]]
    bounds = _without_tapes(view, columns, part, seen, face, bounds)
    return [part[(part >= first + a) & (part < first + b)] for a, b in pairwise(bounds)]


def _without_tapes(
    view: LevelView, columns: Columns, part: Index, seen: Array, face: Mask, bounds: list[int]
) -> list[int]:
    """Return the bounds of parts of different colours; narrow stripes between two alike are no part."""
    metre = view.pixel * float(np.median(columns.x[part]))

    def alike(one: tuple[int, int], other: tuple[int, int]) -> bool:
        one_colour, other_colour = (np.median(seen[:, a:b][face[:, a:b]], axis=0) for a, b in (one, other))
        return float(np.linalg.norm(one_colour - other_colour)) < _COLOUR_STEP

    kept, i = bounds, 1
    while i + 1 < len(kept):
        before, after = (kept[i - 1], kept[i]), (kept[i], kept[i + 1])
        is_stripe = i + 2 < len(kept) and (after[1] - after[0]) * metre < _STRIPE
        if alike(before, after):
            kept = [*kept[:i], *kept[i + 1 :]]
        elif is_stripe and alike(before, (kept[i + 1], kept[i + 2])):
            kept = [*kept[:i], *kept[i + 2 :]]
        else:
            i += 1
    # What is left of a thing behind an upright, or a part of a tape there.
    narrow = _NARROW / metre
    first, last = kept[1] - kept[0] < narrow, kept[-1] - kept[-2] < narrow
    return [kept[0], *kept[1 + first : len(kept) - 1 - last], kept[-1]]
