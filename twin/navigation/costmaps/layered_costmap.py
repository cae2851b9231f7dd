"""Costmaps kept up to date from a map, scans, clouds, range sensors and masks, layer by layer as Nav2's."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from twin.errors import MapError
from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.costmaps.filters import KeepoutFilter
from twin.navigation.costmaps.inflation import Inflation
from twin.navigation.costmaps.kernels import Cells
from twin.navigation.costmaps.layer import CellLayer, Layer, SensedLayer
from twin.navigation.costmaps.observation import Observation
from twin.navigation.costmaps.obstacle_layer import ObstacleLayer
from twin.navigation.costmaps.range_sensor_layer import RangeSensorLayer
from twin.navigation.costmaps.voxel_layer import Columns, VoxelLayer
from twin.navigation.costmaps.window import NOTHING, Window, everything
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.plugins import LAYERS, create

__all__ = ["CostmapConfig", "LayeredCostmap"]

_SAME_FRAME = Pose2(0.0, 0.0, 0.0)


class _Zones(CellLayer):
    """The mask of a keep-out filter on the grid."""

    is_known = True


@dataclass(kw_only=True)
class LayeredCostmap:
    """Layers, and the master grid that they make, as `LAYERS` has them, with keep-out zones before inflation.

    What comes in only notes the window that it changed; `costmap` combines and inflates that window, once,
    when it is asked for. So a scan costs what it changed, and a window that rolls twice is inflated once.

    Raises:
        MapError: the static map is turned (origin yaw), or the window is to roll over a static map.
    """

    config: CostmapConfig = field(default_factory=CostmapConfig)
    static_map: OccupancyMap | None = None

    def __post_init__(self) -> None:
        config, static = self.config, self.static_map
        if static is not None and (static.origin.yaw != 0.0 or config.rolling_window):
            raise MapError("a costmap takes a static map only with origin yaw 0 and without rolling_window")
        resolution = config.resolution if static is None else static.resolution
        unknown = NO_INFORMATION if config.track_unknown_space and not config.rolling_window else FREE_SPACE
        if static is None:
            shape = round(config.height / resolution), round(config.width / resolution)
            origin = (-config.width / 2.0, -config.height / 2.0)
        else:
            shape, origin = static.data.shape, (static.origin.x, static.origin.y)
        self._polygon = config.polygon
        self._static: Cells = np.full(shape, unknown, dtype=np.uint8)
        if static is not None and "static_layer" in config.plugins:
            self._static = _static_costs(static, config)
        self._grid = Costmap(
            costs=np.empty_like(self._static),
            resolution=resolution,
            origin=origin,
            inscribed_radius=config.inscribed_radius,
            cost_scaling_factor=config.cost_scaling_factor,
        )
        self._master = self._empty()
        self._inflation = Inflation(
            resolution=resolution,
            inscribed_radius=self._grid.inscribed_radius,
            inflation_radius=config.inflation_radius,
            cost_scaling_factor=config.cost_scaling_factor,
            inflate_unknown=config.inflate_unknown,
        )
        self._own = {name: create(LAYERS, own) for name, own in config.own_layers.items()}
        self._obstacles = ObstacleLayer(self.shape)
        self._voxels: VoxelLayer | None = None
        self._ranges: RangeSensorLayer | None = None
        self._keepout: Cells | None = None
        self._known: Costmap | None = None
        self._dirty = everything(self.shape)
        self._all_costs_stale = True

    def _layers(self) -> tuple[list[Layer], list[Layer]]:
        """Return the layers that are inflated, over the static one, and those that come after, in order."""
        names: tuple[str, ...] = self.config.plugins
        zones: list[Layer] = [] if self._keepout is None else [_Zones(self._keepout)]
        there: dict[str, Layer | None] = {
            "obstacle_layer": self._obstacles,
            "voxel_layer": self._voxels,
            "range_sensor_layer": self._ranges,
            **self._own,
        }
        at = names.index("inflation_layer") if "inflation_layer" in names else len(names)
        below = [layer for name in names[:at] if (layer := there.get(name)) is not None]
        above = [layer for name in names[at:] if (layer := there.get(name)) is not None]
        return (below + zones, above) if self.config.keepout_before_inflation else (below, above + zones)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width [cells]."""
        height, width = self._static.shape
        return height, width

    @property
    def costmap(self) -> Costmap:
        """The master grid, up to date; its costs are written again when it is asked for later."""
        if not self._dirty.empty:
            self._refresh()
        return self._grid

    @property
    def known(self) -> Costmap:
        """What the map and the masks say without anything that a sensor has seen; kept until one changes."""
        if self._known is None:
            whole, master, known = everything(self.shape), self._empty(), self._empty()
            below, above = ([one for one in layers if one.is_known] for layers in self._layers())
            self._combine(master, below, whole)
            self._finish(known, master, above, whole)
            self._known = known
        return self._known

    def update(self, scan_points: ArrayLike, sensor_origin: ArrayLike, robot: Pose2 | None = None) -> None:
        """Clear along the rays of a scan and mark its points.

        Args:
            scan_points: Ends of the rays, shape (n, 2), in the costmap's frame [m]. A ray without return ends
                beyond `obstacle_max_range`: it clears and does not mark. NaN points are skipped.
            sensor_origin: x, y of the sensor in the costmap's frame [m].
            robot: Pose of the base in the costmap's frame; the cells under its footprint become free.
        """
        points = np.array(scan_points, dtype=np.float64, order="C").reshape(-1, 2)
        x, y = np.asarray(sensor_origin, dtype=np.float64).tolist()
        config = self.config
        marking = float(config.obstacle_min_range), float(config.obstacle_max_range)
        clearing = float(config.raytrace_min_range), float(config.raytrace_max_range)
        self._touch(self._obstacles.trace(points, (x, y), marking, clearing, self._grid.frame))
        if robot is not None and config.footprint_clearing_enabled:
            self._touch(self._obstacles.clear_polygon(robot.apply(self._polygon), self._grid.frame))

    def observe(self, observations: Sequence[Observation], robot: Pose2 | None = None) -> None:
        """Clear along the rays of clouds and mark their points, each in the layer of its source.

        Args:
            observations: All that is to be taken at a time: no ray clears what another one of them marks.
            robot: Pose of the base in the costmap's frame; the cells under its footprint become free.
        """
        frame, polygon = self._grid.frame, None if robot is None else robot.apply(self._polygon)
        flat = [one for one in observations if one.source.layer == "obstacle_layer"]
        voxels = [one for one in observations if one.source.layer == "voxel_layer"]
        if flat:
            self._touch(self._obstacles.observe(flat, frame))
            if polygon is not None and self.config.footprint_clearing_enabled:
                self._touch(self._obstacles.clear_polygon(polygon, frame))
        if voxels:
            if self._voxels is None:
                self._voxels = VoxelLayer(self.shape, self.config.voxel_layer)
            self._touch(self._voxels.observe(voxels, frame))
            if polygon is not None and self.config.voxel_layer.footprint_clearing_enabled:
                self._touch(self._voxels.clear_polygon(polygon, frame))

    @property
    def columns(self) -> Columns | None:
        """The columns of the voxel layer, shape (height, width); None until it has seen something."""
        return None if self._voxels is None else self._voxels.columns

    def update_range(
        self, sensor: Pose2, distance: float, limits: tuple[float, float], field_of_view: float
    ) -> None:
        """Take a reading of a sonar or infrared sensor; arguments as those of `RangeSensorLayer.add`."""
        if self._ranges is None:
            self._ranges = RangeSensorLayer(self.shape, self.config.range_sensor_layer)
        self._touch(self._ranges.add(sensor, distance, limits, field_of_view, self._grid.frame))

    def set_keepout(
        self, keepout: KeepoutFilter | None, robot: Pose2 | None = None, T_mask_costmap: Pose2 = _SAME_FRAME
    ) -> None:
        """Lay a keep-out mask over the costmap, or take it away; call it again when the frames have moved.

        Arguments as those of `KeepoutFilter.costs`.
        """
        layer = (
            None if keepout is None else keepout.costs(self.shape, self._grid.frame, robot, T_mask_costmap)
        )
        same = layer is self._keepout or (
            layer is not None and self._keepout is not None and np.array_equal(layer, self._keepout)
        )
        if not same:
            self._keepout = layer
            self._stale()
            self._known = None

    def move_to(self, x: float, y: float) -> None:
        """Centre a rolling window on a point [m], by whole cells; what leaves it is forgotten.

        Raises:
            ValueError: the costmap does not roll.
        """
        if not self.config.rolling_window:
            raise ValueError("move_to needs rolling_window")
        (height, width), old = self.shape, self._grid
        column, row = old.world_to_cell(x, y)
        dx, dy = column - width // 2, row - height // 2
        if dx == 0 and dy == 0:
            return
        for layer in self._sensed():
            layer.move(dx, dy)
        self._keepout = None  # the mask stays where it is: whoever has it lays it anew
        origin = (old.origin[0] + dx * old.resolution, old.origin[1] + dy * old.resolution)
        self._grid = replace(self._empty(), origin=origin)
        self._master = replace(self._master, origin=origin)
        self._known = None
        self._stale()

    def update_layers(self, robot: Pose2 | None, now_ns: int) -> None:
        """Let the layers of a user say what changes; see `Layer.update_bounds`."""
        for layer in self._own.values():
            window = layer.update_bounds(self._grid, robot, now_ns).clipped(self.shape)
            if not window.empty:
                self._touch(window)
                self._known = None if layer.is_known else self._known

    def adopt(self, old: LayeredCostmap) -> None:
        """Take what sensors saw on the last map's costmap, in the same frame, where it lies on this one.

        So obstacles stay when a new map comes, as in Nav2 where its geometry is the same; a map that grows
        while it is made has another one each time. Of cells of another size nothing is taken.
        """
        self._own = old._own
        resolution = self._grid.resolution
        if not math.isclose(old._grid.resolution, resolution, rel_tol=1e-6):
            return
        dx, dy = (
            round((mine - others) / resolution)
            for mine, others in zip(self._grid.origin, old._grid.origin, strict=True)
        )
        self._obstacles.adopt(old._obstacles, dx, dy)
        if old._voxels is not None:
            self._voxels = VoxelLayer(self.shape, self.config.voxel_layer)
            self._voxels.adopt(old._voxels, dx, dy)
        if old._ranges is not None:
            self._ranges = RangeSensorLayer(self.shape, self.config.range_sensor_layer)
            self._ranges.adopt(old._ranges, dx, dy)
        self._stale()

    def clear(self) -> None:
        """Forget every obstacle that the static map and the masks do not hold (clear_entirely)."""
        self._forget(everything(self.shape), outside=False)

    def mark(self, points: Array) -> None:
        """Mark points, shape (n, 2) [m], of a map for instance; a ray through one clears it as ever."""
        self._touch(self._obstacles.mark(points, self._grid.frame))

    def clear_area(self, x: float, y: float, size: float, *, outside: bool = False) -> None:
        """Forget obstacles in a square about a point, or everywhere else.

        Source: nav2_costmap_2d ClearCostmapService and CostmapLayer::clearArea (`clear_around_robot`,
        `clear_except_region`): cells strictly between those of the square's corners.

        Args:
            x: Centre [m].
            y: Centre [m].
            size: Edge of the square [m].
            outside: Whether what is outside of the square is forgotten instead.
        """
        half = size / 2.0
        x0, y0 = self._grid.world_to_cell(x - half, y - half)
        x1, y1 = self._grid.world_to_cell(x + half, y + half)
        self._forget(Window(x0 + 1, y0 + 1, x1, y1).clipped(self.shape), outside=outside)

    def _forget(self, window: Window, *, outside: bool) -> None:
        if window.empty and not outside:
            return
        for sensed in self._sensed():
            self._touch(sensed.forget(window, outside=outside))
        for layer in self._own.values():
            layer.reset()
            self._stale()

    def _sensed(self) -> Iterator[SensedLayer]:
        """Yield the layers that remember what sensors have seen."""
        yield self._obstacles
        if self._voxels is not None:
            yield self._voxels
        if self._ranges is not None:
            yield self._ranges

    def _empty(self) -> Costmap:
        """Return a grid whose costs are to be written."""
        return replace(self._grid, costs=np.empty_like(self._static))

    def _touch(self, window: Window) -> None:
        self._dirty = self._dirty.joined(window)

    def _stale(self) -> None:
        self._dirty, self._all_costs_stale = everything(self.shape), True

    def _refresh(self) -> None:
        """Combine the layers where they changed, and inflate as far around as that reaches."""
        window, self._dirty = self._dirty, NOTHING
        below, above = self._layers()
        self._combine(self._master, below, window)
        around = everything(self.shape)
        if not self._all_costs_stale:
            around = window.grown(self._inflation.reach).clipped(self.shape)
        self._all_costs_stale = False
        self._finish(self._grid, self._master, above, around)

    def _combine(self, master: Costmap, layers: Sequence[Layer], window: Window) -> None:
        """Lay layers over the static one."""
        master.costs[window.slices] = self._static[window.slices]
        for layer in layers:
            layer.update_costs(master, window)

    def _finish(self, grid: Costmap, master: Costmap, layers: Sequence[Layer], window: Window) -> None:
        """Inflate, and lay layers over that."""
        if "inflation_layer" in self.config.plugins:
            self._inflation.write(grid.costs, master.costs, window)
        else:
            grid.costs[window.slices] = master.costs[window.slices]
        for layer in layers:
            layer.update_costs(grid, window)


def _static_costs(occupancy: OccupancyMap, config: CostmapConfig) -> Cells:
    """Return the costs of a map's cells, before inflation: nav2's StaticLayer::interpretValue."""
    threshold, levels = config.lethal_cost_threshold, np.arange(101)
    table = np.zeros(256, dtype=np.uint8)
    if not config.trinary_costmap:
        table[:101] = levels / threshold * LETHAL_OBSTACLE * (levels < threshold)
    table[:101][levels >= threshold] = LETHAL_OBSTACLE
    table[255] = NO_INFORMATION if config.track_unknown_space else FREE_SPACE
    costs: Cells = table[occupancy.data.view(np.uint8)]
    return costs
