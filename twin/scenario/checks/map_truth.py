"""The true walls of a place, to hold a robot's map against; only checks know them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation.maps.occupancy_map import UNKNOWN, OccupancyMap
from twin.scenario.observation import Surroundings
from twin.warehouse.footprint import Rectangle

OCCUPIED_FROM = 65
"""Occupancy from which a cell is a wall, as map savers have it."""
FREE_TO = 25
"""Occupancy up to which a cell is free, likewise."""
_CELL = 0.05
_MARGIN = 0.5
_NEIGHBOURS = 4
"""Among so many cells whose centres are nearest is the one whose edge is, or one that is 2 mm further."""
_BESIDE = 0.02
"""So far before a surface lies the floor that it borders on [m]."""


class MapTruth:
    """What a perfect map would hold: surfaces at the lidar's height, floor that can be driven on.

    Raises:
        ValueError: There is nothing that a lidar could see.
    """

    def __init__(self, surroundings: Surroundings) -> None:
        if not surroundings.solids:
            raise ValueError("there is nothing that a lidar could see")
        self._solids = surroundings.solids
        corners = np.concatenate([solid.corners for solid in self._solids])
        self._low = corners.min(axis=0) - _MARGIN
        width, height = np.ceil((corners.max(axis=0) + _MARGIN - self._low) / _CELL).astype(int)
        rows, columns = np.mgrid[:height, :width]
        self._centres = self._low + (np.stack([columns, rows], axis=-1) + 0.5) * _CELL
        solid = self._inside(self._centres)
        self._floor = self._reachable(solid, surroundings)
        self.wall_points: Array
        """Every 5 cm a point of the surfaces beside the floor that the robot can get to, shape (n, 2) [m]."""
        self.wall_points, self._wall_fronts = self._bordering()

    @property
    def floor_points(self) -> Array:
        """Every 5 cm a point of the floor that the robot can cover, shape (n, 2) [m]."""
        return self._centres[self._floor]

    def distances(self, points: Array) -> Array:
        """Return the distances of points, shape (n, 2), to the nearest surface, shape (n,) [m]."""
        nearest = np.full(len(points), np.inf)
        for solid in self._solids:
            nearest = np.minimum(nearest, np.hypot(*(_on_surface(solid, points) - points).T))
        return nearest

    def distances_of_cells(self, grid: OccupancyMap) -> Array:
        """Return the distances of a map's occupied cells to the nearest surface, shape (n,) [m].

        A cell is a square: one that a surface goes through or along has none.
        """
        centres = wall_cells(grid)
        nearest = np.full(len(centres), np.inf)
        for solid in self._solids:
            nearest = np.minimum(nearest, _off_squares(_on_surface(solid, centres) - centres, grid))
        return nearest

    def distances_of_walls(self, grid: OccupancyMap) -> Array:
        """Return the distances of the walls' points to the map's nearest occupied cell, shape (n,) [m].

        Walls behind ground that is unknown on the map are left out: they are missing, not wrong.
        """
        cells = wall_cells(grid)
        points = self.wall_points[grid.value_at(self._wall_fronts) != UNKNOWN]
        if not len(cells) or not len(points):
            return np.full(len(points), np.inf)
        from scipy.spatial import cKDTree  # takes a third of a second to import, and few runs judge a map

        count = min(_NEIGHBOURS, len(cells))
        nearest = cells[cKDTree(cells).query(points, k=count)[1].reshape(-1, count)]
        offsets = points[:, None] - nearest
        return _off_squares(offsets.reshape(-1, 2), grid).reshape(-1, count).min(axis=1)

    def _inside(self, points: Array) -> NDArray[np.bool_]:
        inside = np.zeros(points.shape[:-1], dtype=np.bool_)
        for solid in self._solids:
            local = np.abs(solid.centre.inverse().apply(points.reshape(-1, 2)))
            within = np.all(local <= (solid.size_x / 2.0, solid.size_y / 2.0), axis=1)
            inside |= within.reshape(inside.shape)
        return inside

    def _reachable(self, solid: NDArray[np.bool_], surroundings: Surroundings) -> NDArray[np.bool_]:
        """Return the floor that a disc of the robot's radius covers, rolling from the start."""
        from scipy import ndimage

        roomy = ndimage.distance_transform_edt(~solid) * _CELL > surroundings.radius
        labels, _ = ndimage.label(roomy)
        start = surroundings.start
        column, row = np.floor((np.array([start.x, start.y]) - self._low) / _CELL).astype(int)
        if not (0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]) or labels[row, column] == 0:
            return np.zeros(solid.shape, dtype=np.bool_)
        centres = labels == labels[row, column]
        covered: NDArray[np.bool_] = (
            ndimage.distance_transform_edt(~centres) * _CELL <= surroundings.radius
        ) & ~solid
        return covered

    def _bordering(self) -> tuple[Array, Array]:
        """Return points of the surfaces beside the floor, and one a cell before each, shape (n, 2)."""
        outlines = [_outline(solid) for solid in self._solids]
        edges, out = (np.concatenate(parts) for parts in zip(*outlines, strict=True))
        fronts = edges + _BESIDE * out
        from scipy import ndimage

        near = ndimage.binary_dilation(self._floor, iterations=2)
        cells = np.floor((fronts - self._low) / _CELL).astype(int)
        beside = ~self._inside(fronts) & near[cells[:, 1], cells[:, 0]]
        return edges[beside], (edges + _CELL * out)[beside]


def _on_surface(solid: Rectangle, points: Array) -> Array:
    """Return the points of a rectangle's edge that are nearest to `points`, both of shape (n, 2)."""
    local = solid.centre.inverse().apply(points)
    half = np.array([solid.size_x / 2.0, solid.size_y / 2.0])
    nearest = np.clip(local, -half, half)
    inside = np.flatnonzero(np.all(np.abs(local) < half, axis=1))
    side = np.argmin(half - np.abs(local[inside]), axis=1)
    nearest[inside, side] = np.copysign(half[side], local[inside, side])
    return solid.centre.apply(nearest)


def _off_squares(offsets: Array, grid: OccupancyMap) -> Array:
    """Return how far points, at `offsets` (n, 2) from cells' centres, are from those cells, shape (n,)."""
    along = Pose2(0.0, 0.0, -grid.origin.yaw).apply(offsets)
    return np.hypot(*np.maximum(np.abs(along) - grid.resolution / 2.0, 0.0).T)


def _outline(solid: Rectangle) -> tuple[Array, Array]:
    """Return points along a rectangle's edge and the outward normals there, both of shape (n, 2)."""
    x, y = solid.size_x / 2.0, solid.size_y / 2.0
    along = np.arange(_CELL / 2.0 - x, x, _CELL), np.arange(_CELL / 2.0 - y, y, _CELL)
    sides = [(np.column_stack([along[0], np.full(len(along[0]), s * y)]), (0.0, s)) for s in (-1.0, 1.0)] + [
        (np.column_stack([np.full(len(along[1]), s * x), along[1]]), (s, 0.0)) for s in (-1.0, 1.0)
    ]
    points = np.concatenate([side for side, _ in sides])
    normals = np.concatenate([np.broadcast_to(normal, side.shape) for side, normal in sides])
    turned = solid.centre.apply(normals) - solid.centre.apply([[0.0, 0.0]])
    return solid.centre.apply(points), turned


def wall_cells(grid: OccupancyMap) -> Array:
    """Return the centres of a map's occupied cells, shape (n, 2) [m]."""
    rows, columns = np.nonzero(grid.data >= OCCUPIED_FROM)
    return grid.cell_to_world(np.column_stack([columns, rows]))
