"""The map of an arena."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import twin.warehouse
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from twin.warehouse import arena as arenas
from twin.warehouse.map_renderer import render

MAPS = Path(twin.warehouse.__file__).parent / "maps"


@pytest.fixture(scope="module")
def grid() -> OccupancyMap:
    return render(arenas.load("warehouse"))


def test_the_committed_map_is_the_rendering(grid: OccupancyMap) -> None:
    committed = OccupancyMap.load(MAPS / "warehouse.yaml")
    np.testing.assert_array_equal(committed.data, grid.data)
    assert committed.resolution == grid.resolution
    assert committed.origin == pytest.approx(grid.origin)


def test_walls_close_the_hall(grid: OccupancyMap) -> None:
    edge = [(x, y) for x in np.arange(-10.1, 10.11, 0.05) for y in (-7.1, 7.1)]
    edge += [(x, y) for y in np.arange(-7.1, 7.11, 0.05) for x in (-10.1, 10.1)]
    assert np.all(grid.value_at(edge) == OCCUPIED)
    assert np.all(grid.value_at([(-9.97, -6.97), (9.97, 6.97), (-4.0, 2.0)]) == FREE)
    assert np.all(grid.value_at([(-10.4, 0.0), (0.0, 7.4)]) == UNKNOWN)


def test_a_rack_is_its_plinth_to_the_cell(grid: OccupancyMap) -> None:
    # rack_a covers x -4.5 to 1.5, y 3.6 to 4.2.
    columns, rows = np.meshgrid(np.arange(-5.0, 2.0, 0.05) + 0.025, np.arange(3.4, 4.5, 0.05) + 0.025)
    points = np.stack((columns, rows), axis=-1)
    inside = (columns > -4.5) & (columns < 1.5) & (rows > 3.6) & (rows < 4.2)
    np.testing.assert_array_equal(grid.value_at(points) == OCCUPIED, inside)


def test_a_turned_pillar_is_covered_and_not_more_than_a_cell_wider(grid: OccupancyMap) -> None:
    pillar = Pose2(5.2, -3.2, math.radians(45.0))
    local = np.stack(np.meshgrid(np.linspace(-0.199, 0.199, 60), np.linspace(-0.199, 0.199, 60)), axis=-1)
    assert np.all(grid.value_at(pillar.apply(local.reshape(-1, 2))) == OCCUPIED)
    outline = [(x, y) for x in np.linspace(-0.28, 0.28, 60) for y in (-0.28, 0.28)]
    assert np.all(grid.value_at(pillar.apply(outline)) == FREE)


def test_below_and_above_things_the_map_is_free() -> None:
    above = render(arenas.load("warehouse"), height=1.05)
    # At 1.05 m a pillar is in the way, a pallet with a load of 0.8 m and the plinths are not.
    assert above.value_at([[6.0, 1.2]])[0] == OCCUPIED
    assert np.all(above.value_at([(7.0, -5.7), (-1.4, 3.9)]) == FREE)


def test_the_hall_is_not_symmetric(grid: OccupancyMap) -> None:
    """A lidar cannot mistake it for itself turned by 180 degrees or mirrored."""
    solid = grid.data == OCCUPIED
    for other in (solid[::-1, ::-1], solid[::-1], solid[:, ::-1]):
        assert np.count_nonzero(solid != other) > 0.5 * np.count_nonzero(solid)
