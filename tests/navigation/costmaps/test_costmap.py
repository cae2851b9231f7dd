from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import Costmap, footprint_cost, inflation_costs
from twin.navigation.costmaps.footprint import circle, radii, rectangle
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.maps.occupancy_map import OccupancyMap


def room(width: int = 60, height: int = 50, *, resolution: float = 0.05) -> OccupancyMap:
    data = np.zeros((height, width), dtype=np.int8)
    data[0] = data[-1] = 100
    data[:, 0] = data[:, -1] = 100
    data[20:25, 30:33] = 100
    data[5:12, 40:50] = -1
    return OccupancyMap(data=data, resolution=resolution, origin=Pose2(-1.0, -0.5, 0.0))


def slow_inflation(raw: np.ndarray, config: CostmapConfig, resolution: float) -> np.ndarray:
    """Nav2's inflation by its definition: every cell against every lethal cell."""
    lethal = np.argwhere(raw == 254)
    costs = raw.copy()
    for y in range(raw.shape[0]):
        for x in range(raw.shape[1]):
            distance = np.hypot(*(lethal - (y, x)).T).min() * resolution
            if distance > config.inflation_radius:
                continue
            if distance == 0.0:
                cost = 254
            elif distance <= config.inscribed_radius:
                cost = 253
            else:
                cost = int(252 * math.exp(-config.cost_scaling_factor * (distance - config.inscribed_radius)))
            if costs[y, x] == 255:
                if cost >= 253:
                    costs[y, x] = cost
            else:
                costs[y, x] = max(costs[y, x], cost)
    return costs


def test_static_layer_is_nav2s_inflation() -> None:
    config = CostmapConfig(robot_radius=0.17, inflation_radius=0.4, cost_scaling_factor=5.0)
    occupancy = room()
    raw = np.select([occupancy.data == 100, occupancy.data == -1], [254, 255], 0).astype(np.uint8)
    layered = LayeredCostmap(config=config, static_map=occupancy)
    assert np.array_equal(layered.costmap.costs, slow_inflation(raw, config, 0.05))


def test_published_values_of_the_inflation() -> None:
    costs = inflation_costs(
        [0.0, 0.1, 0.2, 0.3, 0.56], inscribed_radius=0.1, inflation_radius=0.55, cost_scaling_factor=10.0
    )
    assert costs.tolist() == [254, 253, int(252 * math.exp(-1)), int(252 * math.exp(-2)), 0]


def scan_from(x: float, y: float, ranges: np.ndarray) -> np.ndarray:
    angles = np.linspace(-np.pi, np.pi, len(ranges), endpoint=False)
    return np.column_stack([x + ranges * np.cos(angles), y + ranges * np.sin(angles)])


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_updating_windows_gives_the_same_grid_as_inflating_it_all(seed: int) -> None:
    random = np.random.default_rng(seed)
    config = CostmapConfig(
        robot_radius=0.1, inflation_radius=0.3, obstacle_max_range=0.9, raytrace_max_range=1.2
    )
    occupancy = room()
    layered = LayeredCostmap(config=config, static_map=occupancy)
    for _ in range(4):
        sensor = random.uniform((-0.8, -0.3), (1.8, 1.8))
        layered.update(scan_from(*sensor, random.uniform(0.05, 1.5, 50)), sensor)
    obstacles = layered._obstacles.cells
    raw = np.select([occupancy.data == 100, occupancy.data == -1], [254, 255], 0).astype(np.uint8)
    raw = np.where(obstacles == 254, 254, np.where((raw == 255) & (obstacles == 0), 0, raw)).astype(np.uint8)
    want = slow_inflation(raw, config, 0.05)
    assert np.array_equal(layered.costmap.costs, want)


@settings(max_examples=30, deadline=None)
@given(sx=st.floats(0.05, 0.95), sy=st.floats(0.05, 0.95), ex=st.floats(-0.5, 1.5), ey=st.floats(-0.5, 1.5))
def test_a_ray_clears_exactly_the_cells_that_it_crosses(sx: float, sy: float, ex: float, ey: float) -> None:
    assume(math.hypot(ex - sx, ey - sy) > 0.01)
    config = CostmapConfig(width=1.0, height=1.0, obstacle_max_range=0.0, raytrace_max_range=9.0)
    layered = LayeredCostmap(config=config)
    layered.update([[ex - 0.5, ey - 0.5]], (sx - 0.5, sy - 0.5))
    t = np.linspace(0.0, 1.0, 2001)[:, None]
    samples = ((sx, sy) + t * np.subtract((ex, ey), (sx, sy))) / 0.05  # in cells
    cleared = np.argwhere(layered.costmap.costs == 0)[:, ::-1]
    for column, row in np.ndindex(20, 20):
        beyond = np.maximum(np.abs(samples - (column + 0.5, row + 0.5)) - 0.5, -0.5).max(axis=1).min()
        is_cleared = bool((cleared == (column, row)).all(axis=1).any())
        if beyond < -1e-6:
            assert is_cleared, "the ray passes through"
        elif beyond > 0.02:
            assert not is_cleared, "the ray passes by"


def test_an_obstacle_stays_until_a_ray_passes_through_it() -> None:
    layered = LayeredCostmap(config=CostmapConfig(robot_radius=0.1), static_map=room())
    sensor, obstacle = (-0.5, 0.0), (0.012, 0.012)
    layered.update([obstacle], sensor)
    assert layered.costmap.cost_at(*obstacle) == 254
    layered.update([(-0.5, 1.0)], sensor)  # looks elsewhere
    assert layered.costmap.cost_at(*obstacle) == 254
    layered.update([(np.nan, np.nan)], sensor)
    assert layered.costmap.cost_at(*obstacle) == 254
    layered.update([(0.7, 0.027)], sensor)  # sees through
    assert layered.costmap.cost_at(*obstacle) < 253
    layered.clear()
    assert np.array_equal(
        layered.costmap.costs, LayeredCostmap(config=layered.config, static_map=room()).costmap.costs
    )


def test_ranges_limit_marking_and_clearing() -> None:
    config = CostmapConfig(robot_radius=0.1, obstacle_max_range=0.6, raytrace_max_range=0.4)
    layered = LayeredCostmap(config=config, static_map=room())
    sensor = (-0.5, 0.0)
    layered.update([(0.2, 0.01)], sensor)
    assert layered.costmap.cost_at(0.2, 0.01) < 253  # 0.7 m: too far to mark
    layered.update([(0.05, 0.01)], sensor)
    assert layered.costmap.cost_at(0.05, 0.01) == 254
    layered.update([(0.9, 0.012)], sensor)
    assert layered.costmap.cost_at(0.05, 0.01) == 254  # 0.55 m: too far to clear


def test_the_static_map_is_never_cleared() -> None:
    occupancy = room()
    layered = LayeredCostmap(config=CostmapConfig(), static_map=occupancy)
    layered.update(scan_from(0.0, 0.0, np.full(200, 2.9)), (0.0, 0.0))
    assert (layered.costmap.costs[occupancy.data == 100] == 254).all()


def test_a_rolling_window_keeps_what_stays_in_view() -> None:
    config = CostmapConfig(rolling_window=True, width=2.0, height=2.0, robot_radius=0.1)
    layered = LayeredCostmap(config=config)
    layered.move_to(3.0, -1.0)
    layered.update([(3.512, -1.012)], (3.0, -1.0))
    assert layered.costmap.cost_at(3.512, -1.012) == 254
    for x, y in ((3.3, -1.2), (2.9, -0.7), (3.07, -1.01)):
        layered.move_to(x, y)
        assert layered.costmap.cost_at(3.512, -1.012) == 254
        assert layered.costmap.cost_at(3.512, -0.912) == 253
        assert layered.costmap.origin == pytest.approx((x - 1.0, y - 1.0), abs=0.051)
        assert np.count_nonzero(layered.costmap.costs == 254) == 1
    layered.move_to(8.0, 8.0)
    layered.move_to(3.0, -1.0)
    assert not layered.costmap.costs.any()


def test_what_a_layered_costmap_refuses() -> None:
    turned = OccupancyMap(data=np.zeros((2, 2), np.int8), resolution=1.0, origin=Pose2(0.0, 0.0, 0.1))
    with pytest.raises(MapError, match="yaw"):
        LayeredCostmap(static_map=turned)
    with pytest.raises(MapError, match="rolling"):
        LayeredCostmap(config=CostmapConfig(rolling_window=True), static_map=room())
    with pytest.raises(ValueError, match="rolling"):
        LayeredCostmap(static_map=room()).move_to(0.0, 0.0)


@pytest.mark.parametrize("seed", range(40))
def test_footprint_cost_is_the_worst_cell_under_the_outline(seed: int) -> None:
    costmap = LayeredCostmap(config=CostmapConfig(robot_radius=0.1), static_map=room()).costmap
    random, footprint = np.random.default_rng(seed), rectangle(0.5, 0.3)
    pose = Pose2(*random.uniform((-0.6, -0.1, -4.0), (1.6, 1.6, 4.0)))
    if seed % 2:  # every cell another: which ones are looked at matters
        costmap.costs[:] = random.integers(0, 254 if seed % 4 == 1 else 256, costmap.costs.shape)
    corners = pose.apply(footprint)
    under = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = math.ceil(np.hypot(*(b - a)) / 0.025)
        under += [costmap.cost_at(*(a + i / pieces * (b - a))) for i in range(pieces)]
    assert footprint_cost(costmap, footprint, pose) == (254 if 254 in under else max(under))


def test_off_the_map_is_lethal_and_unknown_is_not() -> None:
    costmap = Costmap(costs=np.full((20, 20), 255, dtype=np.uint8), resolution=0.1)
    assert footprint_cost(costmap, rectangle(0.4, 0.4), Pose2(1.0, 1.0, 0.3)) == 255
    assert footprint_cost(costmap, rectangle(0.4, 0.4), Pose2(0.1, 1.0, 0.0)) == 254
    costmap.costs[12, 10] = 254
    assert footprint_cost(costmap, rectangle(0.4, 0.4), Pose2(1.05, 1.05, 0.0)) == 254


def test_radii_of_footprints() -> None:
    assert radii(rectangle(0.6, 0.4)) == pytest.approx((0.2, math.hypot(0.3, 0.2)))
    assert radii(rectangle(0.6, 0.4, x_offset=0.1, padding=0.01))[0] == pytest.approx(0.21)
    assert radii(rectangle(0.6, 0.4, x_offset=1.0))[0] == 0.0
    assert radii(circle(0.3))[0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("corners", "inscribed"),
    [
        ([[0.3, 0.0], [0.0, 0.3], [-0.3, 0.0], [0.0, -0.3]], 0.3 / math.sqrt(2.0)),  # corners on the axes
        ([[0.4, 0.0], [-0.2, 0.2], [-0.2, -0.2]], 0.4 * math.sin(math.atan2(0.2, 0.6))),
        ([[0.0, 0.2], [-0.5, 0.2], [-0.5, -0.2], [0.0, -0.2]], 0.0),  # the base on the front edge
        ([[0.5, 0.2], [0.0, 0.2], [0.0, -0.2], [0.5, -0.2]], 0.0),  # and on the back one
        ([[0.5, 0.3], [0.1, 0.3], [0.1, -0.3], [0.5, -0.3]], 0.0),  # behind it
        ([[-0.1, 0.3], [-0.5, 0.3], [-0.5, -0.3], [-0.1, -0.3]], 0.0),  # before it
    ],
)
def test_the_inscribed_radius_of_any_outline(corners: list[list[float]], inscribed: float) -> None:
    for outline in (corners, corners[::-1]):
        assert radii(outline)[0] == pytest.approx(inscribed)


def test_a_circle_has_as_many_corners_as_nav2s() -> None:
    """nav2_costmap_2d, makeFootprintFromRadius: 16; here its sides touch the circle, not its corners."""
    corners = circle(0.5)
    assert len(corners) == 16
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    assert np.hypot(*middles.T) == pytest.approx(np.full(16, 0.5))
