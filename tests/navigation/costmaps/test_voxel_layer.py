"""Columns of voxels: what clouds mark and clear, against the same said slowly."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION
from twin.navigation.costmaps.costmap_config import CostmapConfig, VoxelConfig
from twin.navigation.costmaps.layered_costmap import LayeredCostmap
from twin.navigation.costmaps.observation import Observation, ObservationSource
from twin.navigation.costmaps.voxel_layer import UNKNOWN_COLUMN, VoxelLayer, marked_voxels

FREE, UNKNOWN, MARKED = range(3)
CAMERA = ObservationSource(
    topic="points", clearing=True, min_obstacle_height=0.1, obstacle_max_range=4.0, raytrace_max_range=5.0
)
LEVELS = VoxelConfig(z_resolution=0.1, z_voxels=16)
FRAME = (-2.0, -2.0, 0.1)
"""Of a grid of 4 x 4 m."""


class SlowLayer:
    """nav2's voxel layer by its definition: a state for each voxel, a cost after each step of each ray."""

    def __init__(
        self, shape: tuple[int, int], config: VoxelConfig, frame: tuple[float, float, float]
    ) -> None:
        self.config, self.frame = config, frame
        self.voxels = np.full((*shape, config.z_voxels), UNKNOWN)
        self.cells = np.full(shape, NO_INFORMATION, dtype=np.uint8)
        self.size = np.array((shape[1], shape[0], config.z_voxels))
        self.edge = np.array((frame[2], frame[2], config.z_resolution))
        self.corner = np.array((frame[0], frame[1], config.origin_z))

    def observe(self, seen: Observation) -> None:
        sensor, source = np.array(seen.sensor), seen.source
        for point in seen.points if source.clearing else ():
            length = math.dist(point, sensor)
            if not (np.isfinite(point).all() and length > 0.0):
                continue
            last = min(1.0 - 2.0 * self.frame[2] / length, source.raytrace_max_range / length)
            first, last = self._clipped(sensor, point - sensor, source.raytrace_min_range / length, last)
            if first <= last:
                for voxel in self._line(*(self._voxel(sensor + t * (point - sensor)) for t in (first, last))):
                    self._clear(voxel)
        for point in seen.points if source.marking else ():
            near = source.obstacle_min_range <= math.dist(point, sensor) < source.obstacle_max_range
            if near and source.min_obstacle_height <= point[2] <= source.max_obstacle_height:
                cell = np.floor((point - self.corner) / self.edge).astype(int)
                cell[2] = max(cell[2], 0)
                if ((cell >= 0) & (cell < self.size)).all():
                    self._mark(cell)

    def _clipped(self, start: Array, way: Array, first: float, last: float) -> tuple[float, float]:
        begin, step = (start - self.corner) / self.edge, way / self.edge
        for axis in range(3):
            if step[axis] == 0.0:
                if not 0.0 <= begin[axis] < self.size[axis]:
                    return 1.0, 0.0
                continue
            ends = sorted((-begin[axis] / step[axis], (self.size[axis] - begin[axis]) / step[axis]))
            first, last = max(first, ends[0]), min(last, ends[1])
        return first, last

    def _voxel(self, point: Array) -> Array:
        return np.clip(((point - self.corner) / self.edge).astype(int), 0, self.size - 1)

    @staticmethod
    def _line(start: Array, end: Array) -> Iterator[Array]:
        """Along the longest axis one by one, the others where they come nearest; ties go on."""
        way = end - start
        most = int(np.abs(way).max())
        for i in range(most + 1):
            steps = [(most // 2 + i * abs(int(part))) // most if most else 0 for part in way]
            yield start + np.sign(way) * steps

    def _clear(self, voxel: Array) -> None:
        x, y, z = voxel
        self.voxels[y, x, z] = FREE
        if np.count_nonzero(self.voxels[y, x] == MARKED) <= self.config.mark_threshold:
            unknown = np.count_nonzero(self.voxels[y, x] == UNKNOWN) > self.config.unknown_threshold
            self.cells[y, x] = NO_INFORMATION if unknown else FREE_SPACE

    def _mark(self, voxel: Array) -> None:
        x, y, z = voxel
        self.voxels[y, x, z] = MARKED
        if np.count_nonzero(self.voxels[y, x] == MARKED) > self.config.mark_threshold:
            self.cells[y, x] = LETHAL_OBSTACLE


def seen_from(
    sensor: tuple[float, float, float], points: Any, source: ObservationSource = CAMERA
) -> Observation:
    return Observation(points=np.array(points, dtype=np.float64).reshape(-1, 3), sensor=sensor, source=source)


def states(columns: Array, z_voxels: int) -> Array:
    """The states of the voxels, shape (height, width, z_voxels), from nav2_voxel_grid's two bits."""
    levels = np.arange(z_voxels, dtype=np.uint32)
    low, high = (
        (columns[..., np.newaxis] >> (levels + shift)) & 1 for shift in (np.uint32(0), np.uint32(16))
    )
    assert not (high > low).any(), "a voxel that is marked is known"
    return low + high


@pytest.mark.parametrize(
    ("config", "sensor", "limits"),
    [
        (LEVELS, (0.033, -0.041, 0.417), {}),
        (LEVELS, (0.033, -0.041, 0.417), {"raytrace_min_range": 0.6, "raytrace_max_range": 1.2}),
        (LEVELS, (0.033, -0.041, 2.519), {}),
        (LEVELS, (-2.513, 0.217, 0.431), {}),
        (
            VoxelConfig(z_voxels=4, origin_z=0.3, mark_threshold=1, unknown_threshold=2),
            (0.513, 0.527, 0.719),
            {},
        ),
    ],
    ids=["inside", "ranges", "above", "outside", "thresholds"],
)
def test_voxels_are_those_of_the_definition(
    config: VoxelConfig, sensor: tuple[float, float, float], limits: dict[str, float]
) -> None:
    source = ObservationSource(topic="points", clearing=True, min_obstacle_height=0.05, **limits)
    rng = np.random.default_rng(1)
    fast, slow = VoxelLayer((40, 40), config), SlowLayer((40, 40), config, FRAME)
    for _ in range(3):
        points = rng.uniform((-2.6, -2.6, -0.2), (2.6, 2.6, 2.4), (400, 3))
        points[::7] = np.round(points[::7], 1)  # on borders
        points[::50] = np.nan, 0.0, np.inf
        before = fast.cells.copy()
        changed = fast.observe([seen_from(sensor, points, source)], FRAME)
        slow.observe(seen_from(sensor, points, source))
        np.testing.assert_array_equal(states(fast.columns, config.z_voxels), slow.voxels)
        np.testing.assert_array_equal(fast.cells, slow.cells)
        before[changed.slices] = fast.cells[changed.slices]
        np.testing.assert_array_equal(before, fast.cells, "outside of the window nothing changed")
    assert len(np.unique(slow.cells)) > 1
    assert len(marked_voxels(fast.columns, config.z_voxels)) == np.count_nonzero(slow.voxels == MARKED)


def layered(**voxels: Any) -> LayeredCostmap:
    """A rolling window of 4 x 4 m about (0, 0), without inflation, of a robot of 0.1 m."""
    levels = {"z_resolution": 0.1, "z_voxels": 16} | voxels
    layers = VoxelConfig(**levels)  # type: ignore[arg-type]
    config = CostmapConfig(
        rolling_window=True, width=4.0, height=4.0, inflation_radius=0.0, voxel_layer=layers
    )
    return LayeredCostmap(config=config)


EYE = (0.0, 0.0, 0.4)
TOP = (1.02, 0.02, 0.52)
"""Of a table."""


def cost(costmap: LayeredCostmap, at: tuple[float, ...] = TOP) -> int:
    return costmap.costmap.cost_at(at[0], at[1])


def test_a_scan_below_a_table_top_does_not_clear_it() -> None:
    costmap = layered()
    costmap.observe([seen_from(EYE, TOP)])
    assert cost(costmap) == LETHAL_OBSTACLE
    costmap.update([[1.8, 0.036]], (0.0, 0.0))
    costmap.observe([seen_from((0.0, 0.0, 0.1), (1.8, 0.036, 0.2))])
    assert cost(costmap) == LETHAL_OBSTACLE, "rays below it"
    costmap.observe([seen_from(EYE, (1.8, 0.036, 0.6))])
    assert cost(costmap) == FREE_SPACE, "a ray through it"


def test_clouds_of_the_obstacle_layer_mark_by_height() -> None:
    flat = ObservationSource(topic="points", layer="obstacle_layer", clearing=True, min_obstacle_height=0.1)
    costmap = layered()
    costmap.observe([seen_from(EYE, [TOP, (1.02, 0.52, 0.02), (1.02, -0.48, 2.2)], flat)])
    assert [cost(costmap, at) for at in (TOP, (1.02, 0.52), (1.02, -0.48))] == [254, 0, 0]
    costmap.observe([seen_from(EYE, (1.8, 0.036, 0.02), flat)])
    assert cost(costmap) == LETHAL_OBSTACLE, "a ray to the floor tells nothing"
    costmap.observe([seen_from(EYE, (1.8, 0.036, 0.3), flat)])
    assert cost(costmap) == FREE_SPACE


def test_what_one_sensor_sees_no_ray_of_another_clears() -> None:
    for layer in ("voxel_layer", "obstacle_layer"):
        source = ObservationSource(topic="points", layer=layer, clearing=True)  # type: ignore[arg-type]
        costmap = layered()
        through = seen_from(EYE, (1.8, 0.036, 0.6), source)
        costmap.observe([seen_from(EYE, TOP, source), through])
        assert cost(costmap) == LETHAL_OBSTACLE
        costmap.observe([through])
        assert cost(costmap) == FREE_SPACE


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf])
def test_a_cloud_of_nothing_changes_nothing(nothing: float) -> None:
    for layer in ("voxel_layer", "obstacle_layer"):
        source = ObservationSource(topic="points", layer=layer, clearing=True)  # type: ignore[arg-type]
        costmap = layered()
        costmap.observe([seen_from(EYE, TOP, source)])
        before = costmap.costmap.costs.copy()
        costmap.observe([seen_from(EYE, np.full((50, 3), nothing), source), seen_from(EYE, [], source)])
        np.testing.assert_array_equal(costmap.costmap.costs, before)


def test_sources_mark_and_clear_only_as_they_say() -> None:
    costmap = layered()
    costmap.observe([seen_from(EYE, TOP, ObservationSource(topic="points", marking=False, clearing=True))])
    assert cost(costmap) == FREE_SPACE
    marks = ObservationSource(topic="points", obstacle_max_range=1.5)
    costmap.observe([seen_from(EYE, [TOP, (1.8, 0.036, 0.6)], marks)])
    assert (cost(costmap), cost(costmap, (1.8, 0.036))) == (LETHAL_OBSTACLE, FREE_SPACE)
    costmap.observe([seen_from(EYE, (1.8, 0.036, 0.6), marks)])
    assert cost(costmap) == LETHAL_OBSTACLE, "by default clouds do not clear, as in Nav2"


def test_voxels_roll_with_the_window_and_are_forgotten_with_it() -> None:
    costmap = layered()
    costmap.observe([seen_from(EYE, [TOP, (-1.48, 0.02, 0.5)])])
    costmap.move_to(1.0, 0.0)
    assert cost(costmap) == LETHAL_OBSTACLE
    assert costmap.columns is not None
    ((column, row, level),) = marked_voxels(costmap.columns, 16)
    assert (column, row) == costmap.costmap.world_to_cell(*TOP[:2]), "the column is where its cell is"
    assert level == 5
    costmap.move_to(0.0, 0.0)
    assert (cost(costmap), cost(costmap, (-1.48, 0.02))) == (LETHAL_OBSTACLE, FREE_SPACE)
    costmap.observe([seen_from(EYE, (1.8, 0.036, 0.6))])
    assert cost(costmap) == FREE_SPACE
    costmap.observe([seen_from(EYE, TOP)])
    costmap.clear_area(-1.0, 0.0, 1.0, outside=True)
    assert cost(costmap) == FREE_SPACE
    assert not len(marked_voxels(costmap.columns, 16))
    assert (costmap.columns[:, -10:] == UNKNOWN_COLUMN).all()


def test_no_voxel_is_where_the_robot_stands() -> None:
    for clears, want in ((True, FREE_SPACE), (False, LETHAL_OBSTACLE)):
        costmap = layered(footprint_clearing_enabled=clears)
        costmap.observe([seen_from(EYE, (0.02, 0.02, 1.0))], Pose2(0.0, 0.0, 0.0))
        assert cost(costmap, (0.02, 0.02)) == want


def test_how_it_is_combined_with_the_layers_before() -> None:
    """nav2_costmap_2d's CombinationMethod: overwrite, the higher one, the higher one of what is known."""
    past = seen_from(EYE, (1.8, 0.036, 0.4))
    for method, want in ((0, FREE_SPACE), (1, LETHAL_OBSTACLE), (2, LETHAL_OBSTACLE)):
        costmap = layered(combination_method=method, unknown_threshold=16)
        costmap.mark(np.array([[1.02, 0.02]]))
        costmap.observe([past])
        assert cost(costmap) == want, f"method {method}"
    for method, want in ((0, LETHAL_OBSTACLE), (1, LETHAL_OBSTACLE), (2, NO_INFORMATION)):
        layers = VoxelConfig(combination_method=method)
        costmap = LayeredCostmap(config=CostmapConfig(voxel_layer=layers, inflation_radius=0.0))
        costmap.observe([seen_from(EYE, TOP)])
        assert cost(costmap) == want, f"method {method}"


def test_a_new_map_keeps_the_voxels() -> None:
    old, new = layered(), layered()
    old.observe([seen_from(EYE, TOP)])
    new.adopt(old)
    assert cost(new) == LETHAL_OBSTACLE
