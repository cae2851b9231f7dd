"""Filter masks: keep-out and speed zones on a map's cells, as nav2's costmap filters read them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.errors import MapError
from twin.geometry import Array
from twin.navigation.maps.map_saver import LOSSLESS_SCALE, SaveParameters
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED, OccupancyMap

KEEPOUT_FILE = SaveParameters(mode="trinary")
"""How a keep-out mask is saved: black is forbidden, as nav2's depot_keepout."""
SPEED_FILE = LOSSLESS_SCALE
"""How a mask of speeds is saved: every per cent is a grey level, as nav2's depot_speed."""


def empty_mask(occupancy: OccupancyMap) -> OccupancyMap:
    """Return a mask without zones, of the cells of a map."""
    return filled(occupancy, FREE)


def filled(occupancy: OccupancyMap, value: int) -> OccupancyMap:
    """Return a map of the cells of another, all of one value."""
    return OccupancyMap(
        data=np.full_like(occupancy.data, value), resolution=occupancy.resolution, origin=occupancy.origin
    )


def outline(polygon: ArrayLike) -> Array:
    """Return the corners of a zone, shape (n, 2) [m], if they are in order around it.

    Raises:
        MapError: fewer than three corners, one that is no number, or edges that cross or touch.
    """
    corners = _corners(polygon)
    ahead = np.roll(corners, -1, axis=0)
    a, b = corners[:, None], ahead[:, None]  # of an edge in each row; c, d of one in each column
    c, d = corners[None], ahead[None]
    beside = (_side(a, b, c) * _side(a, b, d) <= 0.0) & (_side(c, d, a) * _side(c, d, b) <= 0.0)
    low, high = np.minimum(corners, ahead), np.maximum(corners, ahead)
    overlaps = np.all((low[:, None] <= high[None]) & (low[None] <= high[:, None]), axis=-1)
    count = len(corners)
    apart = (np.arange(count)[:, None] - np.arange(count)[None]) % count
    crossing = beside & overlaps & (apart > 1) & (apart < count - 1)
    if crossing.any():
        i, j = np.argwhere(crossing)[0].tolist()
        raise MapError(
            f"the edges {i + 1} and {j + 1} of the zone cross; valid are corners in order around it"
        )
    return corners


def _side(a: Array, b: Array, c: Array) -> Array:
    """Return on which side of the line from `a` to `b` points are: positive on the left."""
    (ux, uy), (vx, vy) = np.moveaxis(b - a, -1, 0), np.moveaxis(c - a, -1, 0)
    return np.asarray(ux * vy - uy * vx)


def with_zone(mask: OccupancyMap, polygon: ArrayLike, value: int) -> OccupancyMap:
    """Return the mask with a zone more.

    Args:
        mask: Of values 0 (no zone) to 100.
        polygon: Corners in the map frame, shape (n, 2), n >= 3 [m]; the even-odd rule holds.
            The cells whose centres are inside are the zone.
        value: 100 forbids; a speed zone's is its limit in per cent; 0 erases.

    Raises:
        MapError: no polygon, a value out of range, or no cell is inside.
    """
    corners = _corners(polygon)
    if not FREE <= value <= OCCUPIED:
        raise MapError(f"a zone's value is {value}; valid is {FREE} to {OCCUPIED}")
    inside = _inside(mask, corners)
    if not inside.any():
        low, high = corners.min(axis=0), corners.max(axis=0)
        x0, y0, x1, y1 = mask.extent
        raise MapError(
            f"no cell of the mask lies in the zone x {low[0]:g} … {high[0]:g}, y {low[1]:g} … {high[1]:g} m; "
            f"the mask spans x {x0:g} … {x1:g}, y {y0:g} … {y1:g} m"
        )
    data = mask.data.copy()
    data[inside] = value
    return OccupancyMap(data=data, resolution=mask.resolution, origin=mask.origin)


def _corners(polygon: ArrayLike) -> Array:
    corners = np.asarray(polygon, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[0] < 3 or corners.shape[1] != 2 or not np.isfinite(corners).all():
        raise MapError("a zone needs three corners or more, each an x and a y in metres")
    return corners


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Array:
    """Return the corners, shape (4, 2) [m], of a rectangle along the axes between two opposite ones."""
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=np.float64)


def circle(x: float, y: float, radius: float) -> Array:
    """Return a polygon, shape (64, 2) [m], about a circle.

    Raises:
        MapError: the radius is not positive.
    """
    if not radius > 0.0:
        raise MapError(f"a zone's radius is {radius:g} m; valid is a positive number")
    angles = np.arange(64) * (2.0 * math.pi / 64)
    return np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])


def same_cells(a: OccupancyMap, b: OccupancyMap) -> bool:
    """Return whether two maps have the same cells: shape, resolution, origin."""
    return (
        a.data.shape == b.data.shape
        and math.isclose(a.resolution, b.resolution, rel_tol=1e-6)
        and np.allclose(a.origin, b.origin, rtol=1e-9, atol=1e-6)
    )


def _inside(mask: OccupancyMap, corners: Array) -> NDArray[np.bool_]:
    """Return which cells' centres are inside, by counting the edges to the right of each (even-odd rule)."""
    local = (mask.origin.inverse().apply(corners)) / mask.resolution
    xs, ys = np.arange(mask.width) + 0.5, np.arange(mask.height) + 0.5
    inside = np.zeros(mask.data.shape, dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(local, np.roll(local, -1, axis=0), strict=True):
        rows = np.flatnonzero((ay > ys) != (by > ys))
        if rows.size:
            crossing = ax + (ys[rows] - ay) * (bx - ax) / (by - ay)
            inside[rows] ^= xs[None, :] < crossing[:, None]
    return inside
