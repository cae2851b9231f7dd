"""Frontiers of a map: borders between what is known to be free and what is unknown (Yamauchi 1997)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from twin.geometry import Array, Pose2
from twin.navigation.exploration.config import FrontierConfig
from twin.navigation.exploration.wavefront import travel_distances, way_back
from twin.navigation.maps.occupancy_map import UNKNOWN, OccupancyMap

_EIGHT = np.ones((3, 3), dtype=np.int8)
_FOUR = ((0, 1), (0, -1), (1, 0), (-1, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Frontier:
    """Unknown cells in one piece, each beside a cell that the robot can get to."""

    points: Array
    """Centres of its cells in the map frame, shape (n, 2) [m]."""
    size: float
    """Number of cells times their edge [m]."""
    distance: float
    """Way of the robot to its nearest cell [m]."""
    target: tuple[float, float]
    """The cell of it that the robot gets to first, [m] in the map frame."""
    gate: tuple[int, int] = field(repr=False)
    """Row and column of the free cell from which it gets there."""

    @property
    def centroid(self) -> tuple[float, float]:
        """Mean of its cells [m]; it may lie anywhere."""
        x, y = self.points.mean(axis=0)
        return float(x), float(y)

    def gap_to(self, point: tuple[float, float]) -> float:
        """Return the distance of a point to the nearest of its cells [m]."""
        return float(np.hypot(*(self.points - point).T).min())


class FrontierMap:
    """A map as seen from where the robot stands: its frontiers, and the ways to them."""

    def __init__(
        self,
        grid: OccupancyMap,
        position: tuple[float, float],
        config: FrontierConfig,
        *,
        leave_out: Sequence[tuple[float, float]] = (),
        around: float = 0.0,
    ) -> None:
        """Find the frontiers.

        Args:
            grid: The map.
            position: Of the robot, in the map frame [m].
            config: What counts as a frontier.
            leave_out: Points near which nothing is a frontier [m].
            around: How near to them [m].
        """
        self._grid = grid
        self._config = config
        unknown = grid.data == UNKNOWN
        clearance = self._clearance()
        roomy = ~unknown & (clearance > config.robot_radius)
        self._distance = np.full(grid.data.shape, np.inf)
        start = self._start(roomy, position)
        if start is not None:
            self._distance[start] = 0.0
            travel_distances(roomy, self._distance)
        self.reachable: NDArray[np.bool_] = np.isfinite(self._distance)
        """Cells that the robot's centre can get to on known ground, shape (h, w)."""
        self._comfortable = self.reachable & (clearance > config.robot_radius + config.goal_clearance)
        passages = clearance > config.inscribed_radius
        travel_distances(~unknown & passages, self._distance)
        wanted = unknown & passages & ~self._near(leave_out, around)
        self.frontiers: tuple[Frontier, ...] = tuple(self._find(wanted))
        """In the order of their cells in the map: from its lower left."""

    def view_of(self, frontier: Frontier, standoff: float) -> Pose2:
        """Return a pose from which the robot looks at a frontier's target.

        It lies on the way there, `standoff` [m] before it; if something hides the target from there, where
        the target is first in view, or for no standoff where it is nearest.
        """
        row, column = self._stand(frontier.gate, standoff)
        reach = self._config.view_distance / self._grid.resolution
        free = (self._grid.data != UNKNOWN) & (self._grid.data < self._config.lethal_threshold)
        seen = seen_from(free, *frontier.gate, max(reach, standoff / self._grid.resolution))
        views = np.argwhere(seen & self._comfortable)
        if len(views) and not (seen[row, column] and self._comfortable[row, column]):
            way = self._distance[tuple(views.T)]
            row, column = views[
                int(np.argmin(way if standoff > 0.0 else np.hypot(*(views - frontier.gate).T)))
            ]
        x, y = self._grid.cell_to_world((column, row))
        yaw = math.atan2(frontier.target[1] - y, frontier.target[0] - x)
        return Pose2(float(x), float(y), yaw)

    def _stand(self, gate: tuple[int, int], standoff: float) -> tuple[int, int]:
        return way_back(self._distance, self.reachable, *gate, standoff / self._grid.resolution)

    def _clearance(self) -> Array:
        """Return the distance of each cell to the nearest obstacle, shape (h, w) [m]."""
        lethal = self._grid.data >= self._config.lethal_threshold
        if not lethal.any():
            return np.full(lethal.shape, np.inf)
        distance: Array = ndimage.distance_transform_edt(~lethal) * self._grid.resolution
        return distance

    def _near(self, points: Sequence[tuple[float, float]], radius: float) -> NDArray[np.bool_]:
        """Return the cells within `radius` [m] of any of the points."""
        near = np.zeros(self._grid.data.shape, dtype=np.bool_)
        reach = math.ceil(radius / self._grid.resolution)
        for column, row in self._grid.world_to_cell(np.reshape(points, (-1, 2))):
            window = (
                slice(max(row - reach, 0), min(row + reach + 1, self._grid.height)),
                slice(max(column - reach, 0), min(column + reach + 1, self._grid.width)),
            )
            rows, columns = np.ogrid[window]
            near[window] |= np.hypot(columns - column, rows - row) * self._grid.resolution < radius
        return near

    def _start(self, passable: NDArray[np.bool_], position: tuple[float, float]) -> tuple[int, int] | None:
        """Return the passable cell nearest to the robot: it may stand on unknown ground or near a wall."""
        rows, columns = np.nonzero(passable)
        if not rows.size:
            return None
        column, row = self._grid.world_to_cell(position)
        nearest = int(np.argmin((columns - column) ** 2 + (rows - row) ** 2))
        return int(rows[nearest]), int(columns[nearest])

    def _find(self, unknown: NDArray[np.bool_]) -> list[Frontier]:
        height, width = unknown.shape
        padded = np.pad(self._distance, 1, constant_values=np.inf)
        beside = np.stack([padded[1 + v : 1 + v + height, 1 + u : 1 + u + width] for v, u in _FOUR])
        nearest = beside.min(axis=0)
        border = unknown & np.isfinite(nearest)
        labels, _ = ndimage.label(border, structure=_EIGHT)
        found = []
        for label, window in enumerate(ndimage.find_objects(labels), start=1):
            rows, columns = np.nonzero(labels[window] == label)
            size = rows.size * self._grid.resolution
            if size < self._config.min_frontier_size:
                continue
            rows, columns = rows + window[0].start, columns + window[1].start
            points = self._grid.cell_to_world(np.column_stack([columns, rows]))
            first = int(np.argmin(nearest[rows, columns]))
            row, column = int(rows[first]), int(columns[first])
            v, u = _FOUR[int(np.argmin(beside[:, row, column]))]
            gate = row + v, column + u
            aside = float(nearest[row, column] - self._distance[self._stand(gate, 0.0)])
            if aside * self._grid.resolution > self._config.view_distance:
                continue
            found.append(
                Frontier(
                    points=points,
                    size=size,
                    distance=float(nearest[row, column]) * self._grid.resolution,
                    target=(float(points[first, 0]), float(points[first, 1])),
                    gate=gate,
                )
            )
        return found


def seen_from(clear: NDArray[np.bool_], row: int, column: int, reach: float) -> NDArray[np.bool_]:
    """Return the cells that a straight line over clear cells joins with one, shape (h, w).

    Args:
        clear: Cells that do not block the view, shape (h, w).
        row: Of the cell that is looked from, or at; so `column`.
        column: Of the cell.
        reach: Length of the longest line [cells].
    """
    rays = max(8, math.ceil(8.0 * reach))  # a cell at the end of the reach is met by more than one
    along = np.arange(0.0, reach + 0.5, 0.5)
    angles = np.arange(rays) * (2.0 * math.pi / rays)
    rows = np.rint(row + np.sin(angles)[:, None] * along).astype(int)
    columns = np.rint(column + np.cos(angles)[:, None] * along).astype(int)
    height, width = clear.shape
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    lit = np.logical_and.accumulate(inside & clear[rows, columns], axis=1)
    seen = np.zeros_like(clear)
    seen[rows[lit], columns[lit]] = True
    return seen
