"""Maps held against the truth: a hall of 8 x 6 m with a box in it, drawn right, shifted, or in part."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from twin.geometry import Pose2, Pose3
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.scenario.checks import CheckEntry, CheckResult
from twin.scenario.checks.map_truth import MapTruth, wall_cells
from twin.scenario.observation import CheckContext, Observation, RobotObservation, Surroundings
from twin.warehouse.footprint import Rectangle

WALLS = (
    Rectangle(Pose2(4.0, -0.1, 0.0), 8.4, 0.2),
    Rectangle(Pose2(4.0, 6.1, 0.0), 8.4, 0.2),
    Rectangle(Pose2(-0.1, 3.0, 0.0), 0.2, 6.4),
    Rectangle(Pose2(8.1, 3.0, 0.0), 0.2, 6.4),
)
BOX = Rectangle(Pose2(5.0, 3.0, 0.3), 1.0, 0.6)
HALL = Surroundings(solids=(*WALLS, BOX), start=Pose2(1.0, 1.0, 0.0), radius=0.3)


def drawn(shift: float = 0.0) -> OccupancyMap:
    """Return the map that a lidar makes: cells that the surfaces go through, free before them."""
    truth = MapTruth(HALL)
    cells = np.floor(truth.wall_points / 0.05 + 20.0 + 1e-9).astype(int)
    data = np.full((160, 200), -1, dtype=np.int8)
    floor = np.floor(truth.floor_points / 0.05 + 20.0).astype(int)
    data[floor[:, 1], floor[:, 0]] = 0
    data[cells[:, 1], cells[:, 0]] = 100
    return OccupancyMap(data=data, resolution=0.05, origin=Pose2(-1.0 + shift, -1.0, 0.0))


def judge(entry: dict[str, Any], grid: OccupancyMap | None, surroundings: Surroundings = HALL) -> CheckResult:
    context = CheckContext(robots=("bot",), surroundings={"bot": surroundings})
    check = CheckEntry.model_validate(entry).build(context)
    bot = RobotObservation(pose=Pose3.from_pose2(Pose2(1.0, 1.0, 0.0)), map=grid)
    check.observe(Observation(time_ns=10**9, robots={"bot": bot}))
    return check.result()


def test_distances_are_those_to_the_surface_from_both_sides() -> None:
    truth = MapTruth(HALL)
    points = np.array([[0.5, 3.0], [-0.05, 3.0], [5.0, 3.0], [7.9, 0.2]])
    assert truth.distances(points) == pytest.approx([0.5, 0.05, 0.3, 0.1])


def test_only_surfaces_beside_the_reachable_floor_count() -> None:
    truth = MapTruth(HALL)
    assert len(truth.wall_points) * 0.05 == pytest.approx(2 * (8 + 6) + 2 * (1.0 + 0.6), rel=0.02)
    assert len(truth.floor_points) * 0.0025 == pytest.approx(8 * 6 - 0.6, rel=0.02)
    fenced = Rectangle(Pose2(2.5, 3.0, 0.0), 0.1, 6.0)
    half = MapTruth(Surroundings(solids=(*WALLS, BOX, fenced), start=HALL.start, radius=0.3))
    assert len(half.floor_points) * 0.0025 == pytest.approx(2.45 * 6, rel=0.02)


def test_a_right_map_is_off_by_less_than_a_cell_has_room_for_and_a_shifted_one_fails() -> None:
    good = judge({"map_accuracy": {"mean": "5 mm", "p95": "2 cm"}}, drawn())
    assert good.passed, good.reason
    shifted = judge({"map_accuracy": {"p95": "5 cm"}}, drawn(shift=0.12))
    assert not shifted.passed
    assert shifted.value == pytest.approx(0.10, abs=0.03)
    assert "95 % within" in shifted.reason


def test_cells_are_squares() -> None:
    truth = MapTruth(HALL)
    data = np.zeros((4, 20), np.int8)
    data[1, [0, 1, 2, 3, 5]] = 100  # beside the wall at x = 0: in it, touching, touching, off it
    grid = OccupancyMap(data=data, resolution=0.05, origin=Pose2(-0.1, 3.0, 0.0))
    assert truth.distances_of_cells(grid) == pytest.approx([0.05, 0.0, 0.0, 0.05, 0.15])
    turned = OccupancyMap(data=data, resolution=0.05, origin=Pose2(3.0, -0.1, np.pi / 2))
    assert truth.distances_of_cells(turned) == pytest.approx([0.05, 0.0, 0.0, 0.05, 0.15])


def test_walls_are_as_far_off_as_the_nearest_square_whichever_it_is() -> None:
    """Every square is looked at, instead of some whose centres are nearest."""
    truth = MapTruth(HALL)
    data = np.zeros((160, 200), np.int8)
    data[np.random.default_rng(0).random(data.shape) < 0.02] = 100
    grid = OccupancyMap(data=data, resolution=0.05, origin=Pose2(-1.0, -1.0, 0.0))
    nearest = np.full(len(truth.wall_points), np.inf)
    for cells in np.array_split(wall_cells(grid), 20):
        off = np.abs(truth.wall_points[:, None] - cells) - 0.025
        nearest = np.minimum(nearest, np.linalg.norm(np.maximum(off, 0.0), axis=2).min(axis=1))
    assert truth.distances_of_walls(grid) == pytest.approx(nearest, abs=0.002)


def test_a_wall_missing_beside_known_floor_counts_and_one_behind_unknown_ground_does_not() -> None:
    truth = MapTruth(HALL)
    whole = drawn()
    data = whole.data.copy()
    data[:, 150:] = -1
    part = OccupancyMap(data=data, resolution=0.05, origin=whole.origin)
    assert truth.distances_of_walls(part).max() < 0.05
    data = whole.data.copy()
    data[115:, :][data[115:, :] == 100] = 0  # what is left of the wall at y = 6 m is free
    hole = OccupancyMap(data=data, resolution=0.05, origin=whole.origin)
    assert truth.distances_of_walls(hole).max() > 1.0
    assert not judge({"map_accuracy": {"p95": "5 cm"}}, hole).passed


def test_a_ghost_wall_counts_in_the_mean() -> None:
    grid = drawn()
    data = grid.data.copy()
    data[60:64, 60:90] = 100
    ghost = OccupancyMap(data=data, resolution=0.05, origin=grid.origin)
    assert judge({"map_accuracy": {"mean": "5 cm"}}, grid).passed
    assert not judge({"map_accuracy": {"mean": "5 cm"}}, ghost).passed


def test_what_is_missing_is_told() -> None:
    whole = {"map_coverage": {"floor": 0.95, "walls": 0.95}}
    assert judge(whole, drawn()).passed
    data = drawn().data.copy()
    data[:, 150:] = -1
    part = OccupancyMap(data=data, resolution=0.05, origin=Pose2(-1.0, -1.0, 0.0))
    walls = judge(whole, part)
    assert "of the walls are on the map" in walls.reason
    floor = judge({"map_coverage": {"floor": 0.95}}, part)
    assert floor.value == pytest.approx(0.81, abs=0.03)
    assert "of the floor is free on the map" in floor.reason


def test_a_wall_is_on_the_map_if_it_is_there_within_10_cm() -> None:
    for shift, found in ((0.07, True), (0.13, False)):
        grid = drawn(shift)
        known = OccupancyMap(data=np.abs(grid.data), resolution=0.05, origin=grid.origin)  # no place unknown
        assert judge({"map_coverage": {"walls": 0.95}}, known).passed is found


def test_no_map_and_no_walls_fail_with_their_reasons() -> None:
    assert judge({"map_accuracy": {"mean": 1}}, None).reason == "bot made no map"
    empty = OccupancyMap(data=np.zeros((5, 5), np.int8), resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    assert not judge({"map_accuracy": {"mean": 1}}, empty).passed
    nothing = Surroundings(solids=(), start=HALL.start, radius=0.3)
    assert (
        judge({"map_accuracy": {"mean": 1}}, drawn(), nothing).reason
        == "there is nothing that a lidar could see"
    )


def test_the_centres_of_occupied_cells() -> None:
    data = np.zeros((3, 3), np.int8)
    data[1, 2] = 100
    grid = OccupancyMap(data=data, resolution=0.1, origin=Pose2(1.0, 2.0, 0.0))
    assert wall_cells(grid) == pytest.approx(np.array([[1.25, 2.15]]))
