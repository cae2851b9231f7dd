"""Where a path turns back over itself, and which of its pieces are driven backwards."""

from __future__ import annotations

import itertools

import numpy as np

from twin.geometry import Array


def cusps(poses: Array) -> list[int]:
    """Return the indices of poses, shape (n, 3), at which the path turns back by more than a right angle."""
    if len(poses) < 3:
        return []
    step = np.diff(poses[:, :2], axis=0)
    moved = np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) > 1e-6)
    a, b = step[moved[:-1]], step[moved[1:]]
    return [int(i) for i in moved[1:][np.einsum("ij,ij->i", a, b) < 0.0]]


def is_reversing(poses: Array) -> bool:
    """Return whether the headings of all but the last pose point against the way to the next one."""
    step = np.diff(poses[:, :2], axis=0)
    yaw = poses[: len(step), 2]
    return bool(np.sum(step[:, 0] * np.cos(yaw) + step[:, 1] * np.sin(yaw)) < 0.0)


def one_way_pieces(poses: Array) -> list[tuple[int, int, bool]]:
    """Return the pieces of a path, shape (n, 3), that are driven in one direction.

    A sharp corner between two pieces that are both driven forwards is none of their ends.

    Returns:
        First and last index of each, and whether it is driven backwards; one ends where the next begins.
    """
    pieces: list[tuple[int, int, bool]] = []
    for first, last in itertools.pairwise([0, *cusps(poses), len(poses) - 1]):
        backwards = is_reversing(poses[first : last + 1])
        if pieces and pieces[-1][2] == backwards:
            first = pieces.pop()[0]
        pieces.append((first, last, backwards))
    return pieces
