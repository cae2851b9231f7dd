"""What stands on a surface, column by column: how far away it is, where its foot is, and where its top."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.perception.boxes.picture import LevelView
from twin.perception.boxes.surface import Surface

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

ON_SURFACE = 0.012
"""What is lower is the surface [m]."""
_FOOT_ROWS = 6
_LONGEST_HOLE = 3
"""Rows without a depth, or with a wrong one, that a face is followed across."""
_BEHIND = 0.1
"""What is farther behind the surface that is seen does not stand on it [m]."""
COARSE = 0.05
"""A face whose pixels are farther apart is seen too flatly to tell how far back it goes [m]."""


def tolerance(x: Any) -> Any:
    """Return by how much a pixel's depth may be off at distances `x` [m]: it grows as a stereo camera's."""
    return 0.012 + 0.02 * x**2


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The nearest upright thing in each column of a level view, if one stands there on the surface."""

    x: Array
    """How far ahead it is [m], nan where there is none, shape (width,)."""
    height: Array
    """Of its top above the surface [m], likewise."""
    is_top_seen: Mask
    """Whether what is above is farther away: else its top is hidden, or outside of the picture."""
    reach: Array
    """How far its top face goes on behind the front [m]; nan where it is not seen."""
    face: Mask
    """Pixels of it, shape (height, width)."""
    foot: Index
    """Lowest row of it."""
    top: Index
    """Highest row of it."""


def standing(view: LevelView, surface: Surface, *, near: float, far: float, max_height: float) -> Columns:
    """Return what stands in each column.

    Args:
        view: Points [m].
        surface: On which it stands.
        near: What is nearer is not looked at [m].
        far: Likewise.
        max_height: What is higher above the surface is not looked at [m].
    """
    x, above = view.xyz[..., 0], surface.above(view.xyz)
    row = np.arange(len(x))[:, None]
    with np.errstate(invalid="ignore"):
        goods = (above > ON_SURFACE) & (above < max_height) & (x > near) & (x < far)
        foot, stands = _foot(view, surface, goods, above)
        face = goods & (row <= foot) & stands
        lowest = face & (row > foot - _FOOT_ROWS)
        at = masked_median(x, lowest)
        for _ in range(2):
            face_now = face & (np.abs(x - at) < tolerance(at))
            at = masked_median(x, face_now)
        face_now, top = _followed(face_now, foot)
        at = masked_median(x, face_now)
    height, is_top_seen, reach = _tops(view, above, at, top)
    return Columns(
        x=at, height=height, is_top_seen=is_top_seen, reach=reach, face=face_now, foot=foot, top=top
    )


def _foot(view: LevelView, surface: Surface, goods: Mask, above: Array) -> tuple[Index, Mask]:
    """Return the row where something stands on the surface, and whether there is one, shape (width,).

    The surface must be seen before it, so that what hangs, or stands behind the board, counts not.
    """
    x = view.xyz[..., 0]
    before = next_measured(x, axis=0, step=1)
    column = np.arange(x.shape[1])
    x_before, above_before = x[before, column], above[before, column]
    # As far as two rows are from one another on the surface.
    spacing = 2.0 * x**2 * view.pixel / max(-surface.offset, 0.02)
    is_foot = goods & (before >= 0) & (np.abs(above_before) < ON_SURFACE)
    is_foot &= (x - x_before < 0.02 + spacing) & (x < surface.reach + _BEHIND)
    is_foot[2:] &= goods[1:-1] & goods[:-2]
    last = x.shape[0] - 1 - np.argmax(is_foot[::-1], axis=0)
    return last, np.asarray(is_foot.any(axis=0))


def _followed(face: Mask, foot: Index) -> tuple[Mask, Index]:
    """Return the pixels that hang together with the foot, and the highest row of them in each column."""
    kept, top = np.zeros_like(face), foot.copy()
    for row in range(int(foot.max(initial=0)), -1, -1):
        here = face[row] & (top - row <= _LONGEST_HOLE) & (row <= foot)
        kept[row] = here
        top[here] = row
    return kept, top


def _tops(view: LevelView, above: Array, at: Array, top: Index) -> tuple[Array, Mask, Array]:
    """Return height, whether its top is seen, and the reach of its top face, shape (width,)."""
    x, column = view.xyz[..., 0], np.arange(len(at))
    behind = next_measured(x, axis=0, step=-1)[top, column]
    hole = top - behind > 1
    edge = np.interp(top - 0.5 - hole, np.arange(len(view.down)), view.down)
    front_height = above[top, column] + (view.down[top] - edge) * at
    exists = behind >= 0
    x_behind, above_behind = x[behind, column], above[behind, column]
    with np.errstate(invalid="ignore"):
        # The upper side of what is higher than the eye is not seen.
        is_flat = (
            exists
            & (view.xyz[top, column, 2] < 0.0)
            & (x_behind > at)
            & (np.abs(above_behind - front_height) < 0.015)
        )
        is_far = exists & (x_behind > at + tolerance(at))
        sky = ~exists & (top > _LONGEST_HOLE) & view.inside[np.maximum(top - _LONGEST_HOLE, 0), column]
        is_seen = is_flat | is_far | sky
    height, reach = front_height.copy(), np.full(len(at), np.nan)
    for u in np.flatnonzero(is_flat):
        rising = np.arange(top[u] - 1, -1, -1)
        lid = rising[np.abs(above[rising, u] - above_behind[u]) < 0.01]
        # Holes are few on a flat surface; what is farther up in the picture is another thing.
        lid = lid[: int(np.argmax(np.diff(lid, prepend=top[u]) < -_LONGEST_HOLE)) or len(lid)]
        if len(lid) >= 2:
            height[u] = float(np.median(above[lid, u]))
            last = lid[-1]
            after = next_measured(x[:, u : u + 1], axis=0, step=-1)[last, 0]
            step = abs(x[last, u] - x[lid[-2], u])
            ends = after >= 0 and x[after, u] > x[last, u] + 2.0 * step
            # A rim is no top.
            if ends and step < COARSE and x[last, u] > at[u] + tolerance(at[u]):
                reach[u] = x[last, u] - at[u] + step * (1.5 if last - after > 1 else 0.5)
    return height, is_seen, reach


def next_measured(x: Array, *, axis: int, step: int) -> Index:
    """Return the index of the nearest measured pixel after each (`step` 1), or before it (-1); -1: none."""
    n = x.shape[axis]
    index = np.arange(n).reshape(-1, 1) if axis == 0 else np.arange(n).reshape(1, -1)
    found = np.where(np.isfinite(x), index, -1 if step < 0 else n)
    if step < 0:
        filled = np.maximum.accumulate(found, axis=axis)
        shifted = np.roll(filled, 1, axis=axis)
        np.moveaxis(shifted, axis, 0)[0] = -1
        return shifted
    filled = np.flip(np.minimum.accumulate(np.flip(found, axis), axis=axis), axis)
    shifted = np.roll(filled, -1, axis=axis)
    np.moveaxis(shifted, axis, 0)[-1] = n
    return np.where(shifted == n, -1, shifted)


def masked_median(values: Array, mask: Mask) -> Array:
    """Return the median of each column's masked values, nan where there are none, shape (width,)."""
    median = np.full(mask.shape[1], np.nan)
    used, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if len(used):
        part = np.s_[rows[0] : rows[-1] + 1, used]
        count, at = mask[part].sum(axis=0), np.arange(len(used))
        ordered = np.sort(np.where(mask[part], values[part], np.inf), axis=0)
        median[used] = (ordered[(count - 1) // 2, at] + ordered[count // 2, at]) / 2.0
    return median
