"""The map of an arena, drawn exactly: what a perfect mapping run with a planar lidar would yield."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError
from twin.geometry import Pose2
from twin.models.shapes import Box
from twin.navigation.maps.occupancy_map import FREE, MOST_CELLS, OCCUPIED, UNKNOWN, OccupancyMap
from twin.warehouse.arena import Arena
from twin.warehouse.footprint import Rectangle

Axis = NDArray[np.floating]
_TOUCH = 1e-6
"""A cell that a shape only touches is not occupied; edges often lie on cell borders [m]."""


def render(
    arena: Arena, *, resolution: float = 0.05, height: float = 0.18, margin: float = 0.5
) -> OccupancyMap:
    """Rasterise the arena's solid structure (no totes) at a height.

    A cell is occupied when a solid that crosses `height` covers any part of it, else free in the hall and
    unknown outside. The origin is the hall's lower-left corner less `margin`, without rotation.

    Args:
        arena: The arena.
        resolution: Edge of a cell [m].
        height: Of the lidar's plane above the floor [m].
        margin: Around the hall [m].

    Raises:
        MapError: a length is not finite, or the map would be too big.
    """
    for name, value in (("height", height), ("margin", margin)):
        if not math.isfinite(value):
            raise MapError(f"{name} {value}; valid is a number of metres")
    hall = arena.file.hall
    x0, y0 = hall.x[0] - margin, hall.y[0] - margin
    columns = round((hall.x[1] + margin - x0) / resolution)
    rows = round((hall.y[1] + margin - y0) / resolution)
    if columns * rows > MOST_CELLS:
        raise MapError(
            f"cells of {resolution:g} m and a margin of {margin:g} m are {columns} x {rows} cells; "
            f"valid are at most {MOST_CELLS}"
        )
    xs = x0 + (np.arange(columns) + 0.5) * resolution
    ys = y0 + (np.arange(rows) + 0.5) * resolution
    grid = np.full((rows, columns), UNKNOWN, dtype=np.int8)
    inside = ((ys > hall.y[0]) & (ys < hall.y[1]))[:, None] & ((xs > hall.x[0]) & (xs < hall.x[1]))
    grid[inside] = FREE
    for rectangle in sections(arena, height):
        grid[_covered(rectangle, xs, ys, resolution)] = OCCUPIED
    for group in arena.file.cylinders.values():
        if height <= group.height:
            for x, y in group.centres:
                _draw_disc(grid, x - x0, y - y0, group.radius, resolution)
    return OccupancyMap(data=grid, resolution=resolution, origin=Pose2(x0, y0, 0.0))


def sections(arena: Arena, height: float) -> Iterator[Rectangle]:
    """Yield the sections of the arena's solid structure with the plane z = `height` [m]."""
    for body in arena.structure:
        for shape in body.shapes:
            T_map_shape = body.T_world_body @ shape.T_body_geometry
            if not shape.solid or not isinstance(shape.geometry, Box):
                continue
            size = shape.geometry.size
            if abs(height - T_map_shape.xyz[2]) <= size[2] / 2.0:
                yield Rectangle(T_map_shape.to_pose2(), size[0], size[1])


def _draw_disc(grid: NDArray[np.int8], x: float, y: float, radius: float, resolution: float) -> None:
    """Occupy the cells that share an area with a disc, its centre from the grid's corner [m]."""
    rows, columns = grid.shape
    c0, r0 = (max(0, math.floor((centre - radius) / resolution)) for centre in (x, y))
    c1, r1 = min(columns, c0 + _span(radius, resolution)), min(rows, r0 + _span(radius, resolution))
    gap_x, gap_y = (
        np.maximum(0.0, np.abs((np.arange(low, high) + 0.5) * resolution - centre) - resolution / 2.0)
        for low, high, centre in ((c0, c1, x), (r0, r1, y))
    )
    near = np.hypot(gap_x, gap_y[:, None]) < radius - _TOUCH
    grid[r0:r1, c0:c1][near] = OCCUPIED


def _span(radius: float, resolution: float) -> int:
    return math.ceil(2.0 * radius / resolution) + 1


def _covered(rectangle: Rectangle, xs: Axis, ys: Axis, resolution: float) -> NDArray[np.bool_]:
    """Return which cells share an area with a rectangle (separating axis theorem), shape (rows, columns)."""
    corners = rectangle.corners
    low, high = corners.min(axis=0), corners.max(axis=0)
    reach = resolution / 2.0 - _TOUCH
    near_x = (xs > low[0] - reach) & (xs < high[0] + reach)
    near_y = (ys > low[1] - reach) & (ys < high[1] + reach)
    c, s = np.cos(rectangle.centre.yaw), np.sin(rectangle.centre.yaw)
    dx, dy = xs - rectangle.centre.x, ys[:, None] - rectangle.centre.y
    # A cell reaches this far along a direction that is turned against the grid.
    turned = reach * (abs(c) + abs(s))
    along = np.abs(c * dx + s * dy) < rectangle.size_x / 2.0 + turned
    across = np.abs(c * dy - s * dx) < rectangle.size_y / 2.0 + turned
    return near_y[:, None] & near_x & along & across
