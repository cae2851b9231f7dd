"""Range sensors, filters, clearing and footprints in the layered costmap."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import inflation_costs
from twin.navigation.costmaps.costmap_config import KeepoutConfig, RangeSensorConfig
from twin.navigation.costmaps.filters import (
    SPEED_FILTER_ABSOLUTE,
    SPEED_FILTER_PERCENT,
    KeepoutFilter,
    SpeedFilter,
    SpeedLimit,
)
from twin.navigation.costmaps.footprint import padded, rectangle
from twin.navigation.costmaps.inflation import Inflation
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.costmaps.obstacle_layer import ObstacleLayer
from twin.navigation.costmaps.range_sensor_layer import RangeSensorLayer
from twin.navigation.costmaps.window import NOTHING, Window, differing
from twin.navigation.maps.occupancy_map import OccupancyMap


def empty(size: float, **config: object) -> LayeredCostmap:
    """A free grid about the origin, without inflation."""
    values: dict[str, object] = {"inflation_radius": 0.0, "track_unknown_space": False, **config}
    return LayeredCostmap(config=CostmapConfig(width=size, height=size, **values))  # type: ignore[arg-type]


# inflation


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), unknown=st.booleans())
def test_inflation_of_a_window_is_that_of_scipys_distance_transform(seed: int, unknown: bool) -> None:
    random = np.random.default_rng(seed)
    master = random.choice(np.array([0, 255, 254, 100], np.uint8), (45, 61), p=[0.8, 0.15, 0.02, 0.03])
    shape = {"inscribed_radius": 0.17, "inflation_radius": 0.45, "cost_scaling_factor": 4.0}
    inflation = Inflation(resolution=0.05, inflate_unknown=unknown, **shape)
    x0, y0 = random.integers(0, 30, 2)
    window = Window(int(x0), int(y0), int(x0 + random.integers(1, 31)), int(y0 + random.integers(1, 15)))
    costs = np.full_like(master, 77)
    inflation.write(costs, master, window)
    distance = (
        ndimage.distance_transform_edt(master != 254)
        if (master == 254).any()
        else np.full(master.shape, 99.0)
    )
    inflated = inflation_costs(distance * 0.05, **shape)
    into_unknown = (inflated >= 253) | (unknown & (inflated > 0))
    want = np.where(master == 255, np.where(into_unknown, inflated, 255), np.maximum(master, inflated))
    assert np.array_equal(costs[window.slices], want[window.slices])
    costs[window.slices] = 77
    assert (costs == 77).all(), "nothing outside of the window is written"


def test_an_inflation_reaches_as_far_as_it_is_told() -> None:
    master = np.zeros((1, 300), dtype=np.uint8)
    master[0, 20] = 254
    shape = {"inscribed_radius": 0.5, "inflation_radius": 10.0, "cost_scaling_factor": 0.1}
    inflation, costs = Inflation(resolution=0.05, inflate_unknown=False, **shape), np.empty_like(master)
    assert inflation.reach == 200
    inflation.write(costs, master, Window(0, 0, 300, 1))
    want = inflation_costs(np.abs(np.arange(300.0) - 20.0) * 0.05, **shape)
    np.testing.assert_array_equal(costs[0], want)


def test_nav2s_map_of_ten_by_ten_metres_has_20_lethal_and_28_inscribed_cells() -> None:
    """navigation2 nav2_costmap_2d/test/integration/inflation_tests.cpp, testInflation."""
    data = np.zeros((10, 10), dtype=np.int8)
    data[6:9, 7:10] = data[2:4, 2:4] = 100
    data[7:9, 4] = 100
    data[1, 4:9] = 100
    assert np.count_nonzero(data) == 20
    square = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    config = CostmapConfig(footprint=square, footprint_padding=0.0, inflation_radius=1.0)
    grid = OccupancyMap(data=data, resolution=1.0, origin=Pose2(0.0, 0.0, 0.0))
    layered = LayeredCostmap(config=config, static_map=grid)
    neighbours = ndimage.binary_dilation(data == 100) & (data == 0)
    assert np.count_nonzero(layered.costmap.costs == 254) == 20
    assert np.array_equal(layered.costmap.costs == 253, neighbours)


# range sensors


def nav2_model(distance: float, phi: float, theta: float, half: float, phi_v: float, cell: float) -> float:
    """The sensor model by its definition: half before it is known, less before the object, more at it."""
    weight = (1 - (1 + math.tanh(2 * (phi - phi_v))) / 2) * max(0.0, 1 - (theta / half) ** 2)
    spread = cell * distance
    if phi < distance - 2 * spread:
        return 0.5 * (1 - weight)
    if phi < distance - spread:
        return 0.5 * weight * ((phi - distance + 2 * spread) / spread) ** 2 + 0.5 * (1 - weight)
    if phi < distance + spread:
        return 0.5 + weight * (0.5 - 0.5 * ((distance - phi) / spread) ** 2)
    return 0.5


def test_a_reading_changes_probabilities_by_nav2s_model() -> None:
    layer = RangeSensorLayer((40, 40))
    sensor, half, distance = Pose2(0.3, 0.9, 0.2), 0.3, 0.8
    layer.add(sensor, distance, (0.05, 3.0), 2 * half, (0.0, 0.0, 0.05))
    target = sensor.apply([distance, 0.0]) / 0.05
    changed = 0
    for row, column in np.ndindex(40, 40):
        dx, dy = sensor.inverse().apply([(column + 0.5) * 0.05, (row + 0.5) * 0.05])
        phi, theta = math.hypot(dx, dy), math.atan2(dy, dx)
        prior = (233 if [column, row] == target.astype(int).tolist() else 127) / 254
        sensed = nav2_model(distance, phi, theta, half, 1.2, 0.05) if abs(theta) <= half else 0.5
        want = sensed * prior / (sensed * prior + (1 - sensed) * (1 - prior)) * 254
        got = layer.cells[row, column]
        assert abs(int(got) - want) < 1.0001, (row, column)
        changed += got != 127
    assert changed > 50


def test_nav2s_readings_of_a_robot_that_drives_forward() -> None:
    """nav2_costmap_2d/test/integration/range_tests.cpp, on its grid of 10 x 10 cells of a metre."""
    layered = LayeredCostmap(
        config=CostmapConfig(
            width=10, height=10, resolution=1.0, inflation_radius=0.0, track_unknown_space=False,
            range_sensor_layer=RangeSensorConfig(clear_on_max_reading=True),
        )
    )  # fmt: skip
    grid = layered.costmap.costs
    ten_degrees = 0.174533
    for x in (2.0, 4.0, 6.0):  # of nav2's grid, whose corner is its origin
        layered.update_range(Pose2(x - 5.0, 0.0, 0.0), 3.0, (1.0, 10.0), ten_degrees)
    grid = layered.costmap.costs
    assert [grid[5, x] for x in (5, 6, 7, 8, 9)] == [254, 0, 254, 0, 254]
    layered.clear()
    layered.update_range(Pose2(-3.0, 0.0, 0.0), 2.0, (1.0, 7.0), ten_degrees)
    assert layered.costmap.costs[5, 4] == 254
    layered.update_range(Pose2(-3.0, 0.0, 0.0), 7.0, (1.0, 7.0), ten_degrees)
    assert layered.costmap.costs[5, 4] == 0


def test_readings_that_are_none_change_nothing() -> None:
    layered = empty(4.0)
    sensor = Pose2(0.0, 0.0, 0.0)
    for distance in (math.nan, 0.01, 3.5, math.inf, -math.inf):
        layered.update_range(sensor, distance, (0.05, 3.0), 0.3)
    layered.update_range(sensor, 0.5, (0.5, 0.5), 0.3)
    assert not layered.costmap.costs.any()
    assert layered._ranges is not None
    assert (layered._ranges.cells == 127).all()


def test_a_sensor_that_tells_only_near_or_not_marks_at_its_range() -> None:
    layered = empty(4.0, range_sensor_layer=RangeSensorConfig(clear_on_max_reading=True))
    for _ in range(3):
        layered.update_range(Pose2(0.012, 0.012, 0.0), -math.inf, (0.5, 0.5), 0.3)
    assert layered.costmap.cost_at(0.512, 0.012) == 254
    layered.update_range(Pose2(0.012, 0.012, 0.0), math.inf, (0.5, 0.5), 0.3)
    assert layered.costmap.cost_at(0.512, 0.012) == 0


def test_what_a_cone_marked_rolls_with_the_window_and_is_cleared() -> None:
    layered = LayeredCostmap(config=CostmapConfig(rolling_window=True, width=4.0, height=4.0))
    for _ in range(3):
        layered.update_range(Pose2(0.0, 0.012, 0.0), 0.6, (0.05, 2.0), 0.3)
    assert layered.costmap.cost_at(0.612, 0.012) == 254
    layered.move_to(0.5, -0.3)
    assert layered.costmap.cost_at(0.612, 0.012) == 254
    layered.clear()
    assert not layered.costmap.costs.any()


# filters


def mask_of(value: int, *, yaw: float = 0.0) -> OccupancyMap:
    """4 x 2 m with its corner at (-1, -1); the right half has a value, a corner is unknown."""
    data = np.zeros((20, 40), dtype=np.int8)
    data[:, 20:] = value
    data[:2, :2] = -1
    return OccupancyMap(data=data, resolution=0.1, origin=Pose2(-1.0, -1.0, yaw))


def test_a_keepout_zone_is_lethal_and_inflated_or_not() -> None:
    for before, beside in ((True, 253), (False, 0)):
        layered = empty(4.0, robot_radius=0.2, inflation_radius=0.4, keepout_before_inflation=before)
        layered.set_keepout(KeepoutFilter(mask=mask_of(100)))
        grid = layered.costmap
        assert grid.cost_at(1.01, 0.0) == grid.cost_at(1.9, 0.9) == 254
        assert grid.cost_at(0.93, 0.0) == beside
        assert grid.cost_at(1.5, 1.7) == 0, "beyond the mask"
        layered.set_keepout(None)
        assert not layered.costmap.costs.any()


def test_values_of_a_mask_are_costs_and_the_higher_cost_wins() -> None:
    layered = empty(4.0)
    layered.update([[1.512, 0.512]], (0.0, 0.5))
    layered.set_keepout(KeepoutFilter(mask=mask_of(40)))
    assert layered.costmap.cost_at(1.712, 0.512) == round(40 * 2.54)
    assert layered.costmap.cost_at(1.512, 0.512) == 254


def test_a_mask_lies_where_its_frame_is() -> None:
    """The costmap's frame is turned in the mask's."""
    T_mask_costmap = Pose2(0.3, -0.2, math.pi / 2)
    layered = empty(4.0)
    layered.set_keepout(KeepoutFilter(mask=mask_of(100, yaw=0.2)), T_mask_costmap=T_mask_costmap)
    mask, grid = mask_of(100, yaw=0.2), layered.costmap
    for row, column in np.ndindex(*grid.costs.shape):
        there = T_mask_costmap.apply(grid.cell_to_world([column, row]))
        assert grid.costs[row, column] == (254 if mask.value_at(there) == 100 else 0)


def test_a_robot_in_a_zone_may_be_let_out_of_it() -> None:
    keepout = KeepoutFilter(
        mask=mask_of(100), config=KeepoutConfig(override_lethal_cost=True, lethal_override_cost=200)
    )
    layered = empty(4.0)
    layered.set_keepout(keepout, Pose2(1.5, 0.0, 0.0))
    assert layered.costmap.cost_at(1.2, 0.0) == 200
    layered.set_keepout(keepout, Pose2(0.0, 0.0, 0.0))
    assert layered.costmap.cost_at(1.2, 0.0) == 254


def test_speed_limits_are_nav2s() -> None:
    """nav2_costmap_2d, SpeedFilter::getSpeedLimitAtPose."""
    percent = SpeedFilter(mask=mask_of(40), type=SPEED_FILTER_PERCENT)
    assert percent.limit_at(1.5, 0.0) == SpeedLimit(True, 40.0)
    assert percent.limit_at(0.0, 0.0) == SpeedLimit(True, 0.0)
    assert percent.limit_at(-0.95, -0.95) is None, "unknown"
    assert percent.limit_at(9.0, 0.0) is None, "outside"
    absolute = SpeedFilter(mask=mask_of(40), type=SPEED_FILTER_ABSOLUTE, base=0.1, multiplier=0.01)
    assert absolute.limit_at(1.5, 0.0) == SpeedLimit(False, pytest.approx(0.5))
    for wrong in (-1.0, 3.0):
        limit = SpeedFilter(mask=mask_of(40), type=SPEED_FILTER_PERCENT, multiplier=wrong).limit_at(1.5, 0.0)
        assert limit == SpeedLimit(True, 0.0), "out of bounds is no limit"


# footprint and clearing


def test_the_cells_under_the_robot_are_free() -> None:
    corners = tuple(map(tuple, rectangle(0.6, 0.4).tolist()))
    layered = empty(4.0, footprint=corners, footprint_padding=0.0)
    robot = Pose2(0.3, 0.2, 0.7)
    xs, ys = np.meshgrid(np.arange(-1.9, 1.9, 0.04), np.arange(-1.9, 1.9, 0.04))
    points = np.column_stack([xs.ravel(), ys.ravel()])
    layered.update(points, (0.0, 0.0))
    marked = layered.costmap.costs.copy()
    layered.update(points, (0.0, 0.0), robot)
    grid = layered.costmap
    for row, column in np.ndindex(*grid.costs.shape):
        x, y = robot.inverse().apply(grid.cell_to_world([column, row]))
        under = abs(x) < 0.3 and abs(y) < 0.2
        assert grid.costs[row, column] == (0 if under else marked[row, column])


def test_footprint_clearing_can_be_switched_off() -> None:
    layered = empty(4.0, robot_radius=0.3, footprint_clearing_enabled=False)
    layered.update([[0.112, 0.012]], (0.0, 0.0), Pose2(0.0, 0.0, 0.0))
    assert layered.costmap.cost_at(0.112, 0.012) == 254


def test_padding_moves_each_corner_away_from_the_base() -> None:
    assert padded([[0.3, 0.2], [-0.3, 0.0]], 0.05).tolist() == [[0.35, 0.25], [-0.35, 0.0]]
    config = CostmapConfig(robot_radius=0.2)
    assert config.inscribed_radius == pytest.approx(0.21)


def marked_everywhere() -> LayeredCostmap:
    layered = empty(4.0)
    layered._obstacles.cells[:] = 254
    layered._stale()
    return layered


@pytest.mark.parametrize("outside", [False, True])
def test_a_square_or_all_but_a_square_is_cleared(outside: bool) -> None:
    layered = marked_everywhere()
    layered.clear_area(0.5, -0.25, 1.0, outside=outside)
    want = np.full((80, 80), 254, dtype=np.uint8)
    want[26:45, 41:60] = 0  # strictly between the cells of the corners
    assert np.array_equal(layered.costmap.costs, want if not outside else 254 - want)


def test_a_square_beside_the_map_clears_nothing_or_all() -> None:
    layered = marked_everywhere()
    layered.clear_area(9.0, 9.0, 1.0)
    assert (layered.costmap.costs == 254).all()
    layered.clear_area(9.0, 9.0, 1.0, outside=True)
    assert not layered.costmap.costs.any()


def test_rays_clear_only_between_their_ranges() -> None:
    layered = empty(4.0, raytrace_min_range=0.5, raytrace_max_range=1.0, obstacle_max_range=0.0)
    layered._obstacles.cells[:] = 254
    layered._stale()
    layered.update([[1.9, 0.012]], (0.0, 0.012))
    row = layered.costmap.costs[40]
    xs = np.arange(80) * 0.05 - 2.0
    assert (row[(xs >= 0.5) & (xs < 1.0)] == 0).all()
    assert (row[(xs < 0.45) | (xs > 1.0)] == 254).all()


def test_a_sensor_that_sees_along_a_line_marks_what_it_hits() -> None:
    layered = LayeredCostmap(config=CostmapConfig(width=4.0, height=4.0, inflation_radius=0.0))
    sensors = (Pose2(0.025, 0.025, 0.0), Pose2(-0.5, -0.71, 2.3))
    for sensor in sensors:
        for _ in range(3):
            layered.update_range(sensor, 0.8, (0.05, 3.0), 0.0)
        for ahead, aside, cost in ((0.8, 0.0, 254), (0.4, 0.0, 0), (0.4, 0.1, 255), (0.8, 0.1, 255)):
            assert layered.costmap.cost_at(*sensor.apply([ahead, aside])) == cost
    layered.update_range(Pose2(0.0, 0.0, 0.0), 0.0, (0.0, 3.0), 0.0)
    coarse = empty(4.0, resolution=0.25)  # centres of cells that are exactly ahead
    coarse.update_range(Pose2(0.125, 0.125, 0.0), 1.0, (0.05, 3.0), 0.0)
    assert coarse.costmap.cost_at(1.125, 0.125) == 254


@pytest.mark.parametrize(
    ("distance", "limits", "field_of_view"),
    [
        (0.8, (0.05, 3.0), math.nan),
        (0.8, (0.05, 3.0), math.inf),
        (0.8, (0.05, 3.0), -0.3),
        (math.inf, (0.05, math.inf), 0.3),
        (-math.inf, (math.inf, math.inf), 0.3),
    ],
)
def test_a_sensor_that_tells_nonsense_is_not_heard(
    distance: float, limits: tuple[float, float], field_of_view: float
) -> None:
    layered = empty(4.0)
    layered.update_range(Pose2(0.0, 0.0, 0.0), distance, limits, field_of_view)
    assert not layered.costmap.costs.any()


# another map


def floor(width: int, height: int, x: float, y: float, resolution: float = 0.05) -> OccupancyMap:
    data = np.zeros((height, width), dtype=np.int8)
    return OccupancyMap(data=data, resolution=resolution, origin=Pose2(x, y, 0.0))


@pytest.mark.parametrize(
    ("width", "height", "x", "y"),
    [(80, 80, -2.0, -2.0), (100, 90, -2.5, -2.25), (60, 70, -1.0, -1.5), (80, 80, -1.79, -2.31)],
)
def test_what_was_seen_is_where_it_was_on_a_map_that_has_grown_or_shrunk(
    width: int, height: int, x: float, y: float
) -> None:
    config = CostmapConfig(inflation_radius=0.0)
    old = LayeredCostmap(config=config, static_map=floor(80, 80, -2.0, -2.0))
    old.update([[1.512, 0.512], [-1.512, 0.112]], (0.0, 0.512))
    for _ in range(3):
        old.update_range(Pose2(0.012, 0.012, 0.0), 0.8, (0.05, 3.0), 0.1)
    layered = LayeredCostmap(config=config, static_map=floor(width, height, x, y))
    layered.adopt(old)
    grid = layered.costmap
    assert grid.cost_at(1.512, 0.512) == grid.cost_at(0.812, 0.012) == 254
    assert grid.cost_at(-1.512, 0.112) == (254 if x < -1.1 else 255)
    assert np.count_nonzero(grid.costs == 254) == np.count_nonzero(old.costmap.costs == 254) - (x >= -1.1)


def test_of_a_map_with_other_cells_nothing_is_taken() -> None:
    config = CostmapConfig(inflation_radius=0.0)
    old = LayeredCostmap(config=config, static_map=floor(80, 80, -2.0, -2.0))
    old.update([[1.5, 0.5]], (0.0, 0.5))
    layered = LayeredCostmap(config=config, static_map=floor(40, 40, -2.0, -2.0, 0.1))
    layered.adopt(old)
    assert not layered.costmap.costs.any()


def test_freeing_a_polygon_tells_the_smallest_window_that_changed() -> None:
    rng = np.random.default_rng(4)
    for _ in range(30):
        layer = ObstacleLayer((20, 24))
        layer.cells = rng.choice(np.array([0, 254], dtype=np.uint8), size=(20, 24), p=[0.9, 0.1])
        before = layer.cells.copy()
        at = Pose2(*rng.uniform((-0.2, -0.2, -3.0), (1.4, 1.2, 3.0)))
        found = layer.clear_polygon(at.apply(rectangle(0.5, 0.3)), (0.0, 0.0, 0.05))
        assert found == differing(before, layer.cells, Window(0, 0, 24, 20))
        assert not layer.cells[before == 0].any()


@pytest.mark.parametrize("changes", [0, 1, 2, 5])
def test_what_differs_is_within_the_smallest_window(changes: int) -> None:
    rng = np.random.default_rng(changes)
    for _ in range(20):
        before = rng.integers(0, 255, size=(20, 24), dtype=np.uint8)
        after = before.copy()
        cells = np.column_stack([rng.integers(4, 13, size=changes), rng.integers(3, 16, size=changes)])
        after[cells[:, 0], cells[:, 1]] += 1
        after[13:], after[:, :3] = 255, 255  # outside of the window
        found = differing(before[4:13, 3:16].copy(), after, Window(3, 4, 16, 13))
        if not changes:
            assert found == NOTHING
        else:
            (y0, x0), (y1, x1) = cells.min(axis=0), cells.max(axis=0) + 1
            assert found == (x0, y0, x1, y1)
