"""Costmaps kept up to date from a static map and scans: Nav2's static, obstacle and inflation layer."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from twin.errors import MapError
from twin.geometry import Array
from twin.navigation.costmaps import footprint as footprints
from twin.navigation.costmaps.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
    inflation_costs,
)
from twin.navigation.costmaps.kernels import Cells, combine_and_inflate, trace_scan
from twin.navigation.maps.occupancy_map import OccupancyMap


@dataclass(frozen=True, kw_only=True)
class CostmapConfig:
    """Parameters of a layered costmap; names and defaults are those of nav2_costmap_2d."""

    resolution: float = 0.05
    """[m]; ignored with a static map, which brings its own."""
    rolling_window: bool = False
    """Whether the grid follows the robot (a local costmap)."""
    width: float = 5.0
    """Of a grid without static map [m]."""
    height: float = 5.0
    """[m]"""
    robot_radius: float = 0.1
    """[m]; ignored with a footprint."""
    footprint: tuple[tuple[float, float], ...] = ()
    """Corners in the base frame [m]."""
    inflation_radius: float = 0.55
    """[m]"""
    cost_scaling_factor: float = 10.0
    """[1/m]"""
    inflate_unknown: bool = False
    track_unknown_space: bool = True
    """Whether -1 of the static map and cells never seen are unknown (255), not free."""
    lethal_cost_threshold: int = 100
    """Occupancy from which a cell of the static map is lethal."""
    trinary_costmap: bool = True
    """Whether occupancies below that are free, not scaled to costs."""
    obstacle_min_range: float = 0.0
    """[m]"""
    obstacle_max_range: float = 2.5
    """Points farther away do not mark [m]."""
    raytrace_max_range: float = 3.0
    """Rays clear up to here [m]."""

    @property
    def polygon(self) -> Array:
        """The footprint, shape (n, 2); the robot's circle if none is given."""
        return np.array(self.footprint) if self.footprint else footprints.circle(self.robot_radius)

    @property
    def inscribed_radius(self) -> float:
        """Of the footprint [m]."""
        return footprints.radii(self.footprint)[0] if self.footprint else self.robot_radius


@dataclass(kw_only=True)
class _Window:
    """A rectangle of cells, end exclusive."""

    x0: int
    y0: int
    x1: int
    y1: int


@dataclass(kw_only=True)
class LayeredCostmap:
    """A master grid kept up to date from a static map and scans; `costmap` is the result.

    The static layer is inflated once; a scan re-inflates only the window in which obstacle cells changed.
    An obstacle stays until a ray passes through its cell.

    Raises:
        MapError: the static map is turned (origin yaw), or the window is to roll over a static map.
    """

    config: CostmapConfig = field(default_factory=CostmapConfig)
    static_map: OccupancyMap | None = None

    def __post_init__(self) -> None:
        config, static = self.config, self.static_map
        if static is not None and (static.origin.yaw != 0.0 or config.rolling_window):
            raise MapError("a costmap takes a static map only with origin yaw 0 and without rolling_window")
        self._resolution = config.resolution if static is None else static.resolution
        unknown = NO_INFORMATION if config.track_unknown_space else FREE_SPACE
        if static is None:
            shape = round(config.height / self._resolution), round(config.width / self._resolution)
            self._base = np.full(shape, FREE_SPACE if config.rolling_window else unknown, dtype=np.uint8)
            self._seen_base = np.zeros(shape, dtype=np.uint8)
            origin = (-config.width / 2.0, -config.height / 2.0)
        else:
            self._base = self._inflated_static(static, unknown)
            self._seen_base = self._inflated_static(static, FREE_SPACE)
            origin = (static.origin.x, static.origin.y)
        self._stamp = self._make_stamp()
        self._obstacles: Cells = np.full(self._base.shape, NO_INFORMATION, dtype=np.uint8)
        self.costmap = self._wrap(self._base.copy(), origin)

    def update(self, scan_points: ArrayLike, sensor_origin: ArrayLike) -> None:
        """Clear along the rays of a scan and mark its points.

        Args:
            scan_points: Ends of the rays, shape (n, 2), in the costmap's frame [m]. A ray without return ends
                beyond `obstacle_max_range`: it clears and does not mark. NaN points are skipped.
            sensor_origin: x, y of the sensor in the costmap's frame [m].
        """
        points = np.array(scan_points, dtype=np.float64, order="C").reshape(-1, 2)
        sensor = np.asarray(sensor_origin, dtype=np.float64)
        config, grid = self.config, self.costmap
        reach = max(config.obstacle_max_range, config.raytrace_max_range)
        window = self._clip(
            *grid.world_to_cell(sensor[0] - reach, sensor[1] - reach),
            *grid.world_to_cell(sensor[0] + reach, sensor[1] + reach),
        )
        rows, columns = slice(window.y0, window.y1), slice(window.x0, window.x1)
        before = self._obstacles[rows, columns].copy()
        trace_scan(
            self._obstacles,
            points,
            float(sensor[0]),
            float(sensor[1]),
            config.obstacle_min_range,
            config.obstacle_max_range,
            config.raytrace_max_range,
            *grid.origin,
            self._resolution,
        )
        changed = before != self._obstacles[rows, columns]
        ys, xs = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
        if ys.size:
            r = self._stamp.shape[0] // 2
            x0, y0 = window.x0 + int(xs[0]) - r, window.y0 + int(ys[0]) - r
            x1, y1 = window.x0 + int(xs[-1]) + r, window.y0 + int(ys[-1]) + r
            self._refresh(self._clip(x0, y0, x1, y1))

    def move_to(self, x: float, y: float) -> None:
        """Centre a rolling window on a point [m], by whole cells; what leaves it is forgotten.

        Raises:
            ValueError: the costmap does not roll.
        """
        if not self.config.rolling_window:
            raise ValueError("move_to needs rolling_window")
        height, width = self._base.shape
        old = self.costmap.origin
        dx = math.floor((x - old[0]) / self._resolution) - width // 2
        dy = math.floor((y - old[1]) / self._resolution) - height // 2
        if dx == 0 and dy == 0:
            return
        origin = (old[0] + dx * self._resolution, old[1] + dy * self._resolution)
        self._obstacles = _shifted(self._obstacles, dx, dy)
        self.costmap = self._wrap(np.empty_like(self._base), origin)
        self._refresh(_Window(x0=0, y0=0, x1=width, y1=height))

    def clear(self) -> None:
        """Forget every obstacle that the static map does not hold (nav2's clear_entirely service)."""
        self._obstacles.fill(NO_INFORMATION)
        np.copyto(self.costmap.costs, self._base)

    def _wrap(self, costs: Cells, origin: tuple[float, float]) -> Costmap:
        return Costmap(
            costs=costs,
            resolution=self._resolution,
            origin=origin,
            inscribed_radius=self.config.inscribed_radius,
            cost_scaling_factor=self.config.cost_scaling_factor,
        )

    def _refresh(self, window: _Window) -> None:
        combine_and_inflate(
            self.costmap.costs,
            self._base,
            self._seen_base,
            self._obstacles,
            self._stamp,
            self.config.inflate_unknown,
            window.x0,
            window.y0,
            window.x1,
            window.y1,
        )

    def _clip(self, x_first: int, y_first: int, x_last: int, y_last: int) -> _Window:
        height, width = self._base.shape
        return _Window(
            x0=min(max(0, x_first), width),
            y0=min(max(0, y_first), height),
            x1=min(max(0, x_last + 1), width),
            y1=min(max(0, y_last + 1), height),
        )

    def _costs_at(self, distance: Array) -> Cells:
        return inflation_costs(
            distance * self._resolution,
            inscribed_radius=self.config.inscribed_radius,
            inflation_radius=self.config.inflation_radius,
            cost_scaling_factor=self.config.cost_scaling_factor,
        )

    def _make_stamp(self) -> Cells:
        r = math.floor(self.config.inflation_radius / self._resolution)
        span = np.arange(-r, r + 1, dtype=np.float64)
        return self._costs_at(np.hypot(span[:, None], span[None, :]))

    def _inflated_static(self, static: OccupancyMap, unknown: int) -> Cells:
        occupancy = static.data
        lethal = occupancy >= self.config.lethal_cost_threshold
        costs = np.where(occupancy < 0, unknown, FREE_SPACE).astype(np.uint8)
        if not self.config.trinary_costmap:
            scaled = (occupancy > 0) & ~lethal
            costs[scaled] = occupancy[scaled] / self.config.lethal_cost_threshold * LETHAL_OBSTACLE
        if not lethal.any():
            return costs
        inflated = self._costs_at(ndimage.distance_transform_edt(~lethal))
        into_unknown = (inflated >= INSCRIBED_INFLATED_OBSTACLE) | self.config.inflate_unknown & (
            inflated > 0
        )
        write = np.where(costs == NO_INFORMATION, into_unknown, inflated > costs)
        costs[write] = inflated[write]
        return costs


def _shifted(cells: NDArray[np.uint8], dx: int, dy: int) -> NDArray[np.uint8]:
    """Return the cells as seen from a window moved by (dx, dy) cells; new cells are unknown."""
    height, width = cells.shape
    moved = np.full_like(cells, NO_INFORMATION)
    if abs(dx) < width and abs(dy) < height:
        target = moved[max(0, -dy) : height - max(0, dy), max(0, -dx) : width - max(0, dx)]
        target[...] = cells[max(0, dy) : height - max(0, -dy), max(0, dx) : width - max(0, -dx)]
    return moved
