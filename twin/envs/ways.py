"""The shortest ways on a map: how far it is to a goal from anywhere, and where to drive next."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.maps.occupancy_map import OccupancyMap

_SPACING = 0.2
"""Of the nodes between which ways lead [m]."""
_MOVES = tuple((x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y)


class Ways:
    """Nodes on a grid over the free part of a map, each joined with the eight around it."""

    def __init__(self, occupancy: OccupancyMap, radius: float) -> None:
        """Take a map, and how far a robot's centre keeps from what is on it [m]."""
        free = np.pad(occupancy.data == 0, 1)
        clearance = ndimage.distance_transform_edt(free)[1:-1, 1:-1] * occupancy.resolution
        x0, y0, x1, y1 = occupancy.extent
        self._xs, self._ys = np.arange(x0 + _SPACING, x1, _SPACING), np.arange(y0 + _SPACING, y1, _SPACING)
        self.shape = len(self._ys), len(self._xs)
        x, y = np.meshgrid(self._xs, self._ys)
        self.nodes: Array = np.column_stack((x.ravel(), y.ravel()))
        """x, y, shape (nodes, 2) [m]."""
        cells = occupancy.world_to_cell(self.nodes)
        self.clearance: Array = clearance[cells[:, 1], cells[:, 0]]
        """To what is on the map, shape (nodes,) [m]."""
        passable = (self.clearance >= radius).reshape(self.shape)
        labels, _ = ndimage.label(passable, structure=np.ones((3, 3)))
        largest = np.argmax(np.bincount(labels[passable], minlength=2))
        self._passable = passable & (labels == largest)
        self.passable: NDArray[np.intp] = np.flatnonzero(self._passable)
        """Nodes that can be driven to from each other."""
        self._graph = self._joined()
        # From a node that a robot cannot be at, the way begins at the nearest one that it can be at.
        away, (row, column) = ndimage.distance_transform_edt(~self._passable, return_indices=True)
        self._nearest = (row * self.shape[1] + column).ravel()
        self._away = away.ravel() * _SPACING

    def _joined(self) -> sparse.csr_array:
        number = np.arange(self._passable.size).reshape(self.shape)
        rows, columns, lengths = [], [], []
        for dx, dy in _MOVES:
            here = (
                slice(max(-dy, 0), self.shape[0] - max(dy, 0)),
                slice(max(-dx, 0), self.shape[1] - max(dx, 0)),
            )
            there = (
                slice(max(dy, 0), self.shape[0] + min(dy, 0)),
                slice(max(dx, 0), self.shape[1] + min(dx, 0)),
            )
            both = self._passable[here] & self._passable[there]
            rows.append(number[here][both])
            columns.append(number[there][both])
            lengths.append(np.full(both.sum(), _SPACING * math.hypot(dx, dy)))
        shape = (number.size, number.size)
        joined = (np.concatenate(rows), np.concatenate(columns))
        return sparse.csr_array((np.concatenate(lengths), joined), shape=shape)

    def node_at(self, x: float, y: float) -> int:
        """Return the passable node nearest to a place [m]."""
        column = np.clip(round((x - self._xs[0]) / _SPACING), 0, self.shape[1] - 1)
        row = np.clip(round((y - self._ys[0]) / _SPACING), 0, self.shape[0] - 1)
        return int(self._nearest[row * self.shape[1] + column])

    def lattice(self, spacing: float) -> NDArray[np.intp]:
        """Return the passable nodes of a coarser grid [m]."""
        every = round(spacing / _SPACING)
        chosen = np.zeros(self.shape, np.bool_)
        chosen[::every, ::every] = True
        return np.flatnonzero(chosen & self._passable)

    def lengths(self, node: int) -> Array:
        """Return the lengths of the shortest ways from anywhere to a node, shape (rows, columns) [m]."""
        found = sparse.csgraph.dijkstra(self._graph, indices=node)
        return np.asarray(found[self._nearest] + self._away).reshape(self.shape)

    @property
    def origin(self) -> tuple[float, float]:
        """x, y of the first node [m]."""
        return float(self._xs[0]), float(self._ys[0])

    def look_up(self, lengths: Array, places: Array, ahead: float, way: Array, points: Array) -> None:
        """Write how far it is to goals, and where to drive next.

        Args:
            lengths: To n goals, shape (n, rows, columns) [m].
            places: x, y first, shape (n, 2 or more) [m].
            ahead: How far along the way the next point is [m].
            way: Written: the length of the way, shape (n,) [m].
            points: Written: x, y of the next points, shape (n, 2) [m].
        """
        x, y = self.origin
        _look_up(lengths, self._nearest, places, x, y, _SPACING, ahead, way, points)


@jit
def _look_up(
    lengths: Array,
    nearest: NDArray[np.intp],
    places: Array,
    x0: float,
    y0: float,
    spacing: float,
    ahead: float,
    way: Array,
    points: Array,
) -> None:
    rows, columns = lengths.shape[1], lengths.shape[2]
    for i in range(places.shape[0]):
        x = min(max((places[i, 0] - x0) / spacing, 0.0), columns - 1.001)
        y = min(max((places[i, 1] - y0) / spacing, 0.0), rows - 1.001)
        column, row = int(x), int(y)
        x, y = x - column, y - row
        field = lengths[i]
        way[i] = (1.0 - y) * ((1.0 - x) * field[row, column] + x * field[row, column + 1]) + y * (
            (1.0 - x) * field[row + 1, column] + x * field[row + 1, column + 1]
        )
        first = nearest[(row + (y >= 0.5)) * columns + column + (x >= 0.5)]
        row, column, gone = first // columns, first % columns, 0.0
        while gone < ahead - 1e-9:
            best_row, best_column = row, column
            for near_row in range(max(row - 1, 0), min(row + 2, rows)):
                for near_column in range(max(column - 1, 0), min(column + 2, columns)):
                    near = near_row * columns + near_column
                    if nearest[near] == near and field[near_row, near_column] < field[best_row, best_column]:
                        best_row, best_column = near_row, near_column
            if best_row == row and best_column == column:
                break  # at the goal
            gone += spacing * math.sqrt(float((best_row - row) ** 2 + (best_column - column) ** 2))
            row, column = best_row, best_column
        points[i, 0], points[i, 1] = x0 + spacing * column, y0 + spacing * row
