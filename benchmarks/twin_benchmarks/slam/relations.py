"""Relations between poses, and by how much a trajectory misses them.

Kümmerle et al., On measuring the accuracy of SLAM algorithms, Autonomous Robots 2009: what counts are poses
relative to each other, not in a frame of the world, so that an early error of heading does not count again
and again.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError
from twin.files.reading import read_text
from twin.geometry import Array, wrap_angles

APART = 60
"""So many scans lie at least between the two of a place seen again ..."""
NEAR = 1.5
"""... and at most so many metres."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Relations:
    """Poses of scans seen from other scans."""

    first: NDArray[np.int64]
    """Indices of scans, shape (n,)."""
    second: NDArray[np.int64]
    """Shape (n,)."""
    poses: Array
    """Of `second` in the frame of `first`: x [m], y [m], yaw [rad], shape (n, 3)."""


@dataclass(frozen=True, kw_only=True)
class RelationErrors:
    """Absolute errors over all relations."""

    translation_mean: float
    """[m]"""
    translation_std: float
    """[m]"""
    rotation_mean: float
    """[deg]"""
    rotation_std: float
    """[deg]"""


def load_relations(path: Path, scans: int) -> Relations:
    """Read lines `i j dx dy dtheta` [m, rad] about a log of so many scans; `#` begins a comment.

    Raises:
        MapError: a line is something else, or names a scan that the log does not have.
    """
    rows = []
    try:
        lines = read_text(path).splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        raise MapError(
            f"{path}: cannot be read as text ({type(fault).__name__}); valid are relations"
        ) from None
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            row = (int(words[0]), int(words[1]), *map(float, words[2:]))
        except (ValueError, IndexError):
            row = ()
        if len(row) != 5 or not 0 <= min(row[:2]) <= max(row[:2]) < scans or not np.all(np.isfinite(row)):
            raise MapError(f"{path}:{number}: valid is 'i j dx dy dtheta' with i and j from 0 to {scans - 1}")
        rows.append(row)
    if not rows:
        raise MapError(f"{path}: has no relations; valid are lines 'i j dx dy dtheta'")
    table = np.array(rows, dtype=np.float64)
    first, second = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
    return Relations(first=first, second=second, poses=table[:, 2:])


def relations_of(reference: Array) -> Relations:
    """Return the relations of a reference, shape (n, 3): of scans in sequence, and of places seen again."""
    count = len(reference)
    first, second = [np.arange(count - 1)], [np.arange(1, count)]
    for scan in range(count - APART):
        later = np.arange(scan + APART, count)
        away = np.hypot(*(reference[later, :2] - reference[scan, :2]).T)
        again = later[away < NEAR]
        first.append(np.full(len(again), scan))
        second.append(again)
    i, j = np.concatenate(first), np.concatenate(second)
    return Relations(first=i, second=j, poses=between(reference[i], reference[j]))


def between(first: Array, second: Array) -> Array:
    """Return poses, shape (n, 3), of `second` in the frames of `first`, of the same shape."""
    c, s = np.cos(first[:, 2]), np.sin(first[:, 2])
    dx, dy = (second[:, :2] - first[:, :2]).T
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, wrap_angles(second[:, 2] - first[:, 2])])


def errors(relations: Relations, poses: Array) -> RelationErrors:
    """Return by how much poses of all scans, shape (n, 3), miss the relations."""
    missed = between(relations.poses, between(poses[relations.first], poses[relations.second]))
    translation = np.hypot(missed[:, 0], missed[:, 1])
    rotation = np.degrees(np.abs(missed[:, 2]))
    return RelationErrors(
        translation_mean=float(translation.mean()),
        translation_std=float(translation.std()),
        rotation_mean=float(rotation.mean()),
        rotation_std=float(rotation.std()),
    )
