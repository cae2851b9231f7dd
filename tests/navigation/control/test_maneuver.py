"""A blocked robot finds a way on, its whole footprint free, and drives it; where there is none it says so."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.navigation.control.maneuver import Maneuver, find_maneuver
from twin.navigation.control.maneuver_config import ManeuverConfig
from twin.navigation.costmaps.costmap import LETHAL_OBSTACLE, Costmap
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.costmaps.kernels import footprint_hits, outline_cost

LONG = rectangle(0.9, 0.6)
DT = 0.06


def hall(*boxes: tuple[float, float, float, float]) -> Costmap:
    """A square of 4 m about the origin with boxes: x from, x to, y from, y to [m]."""
    costs = np.zeros((80, 80), dtype=np.uint8)
    for x0, x1, y0, y1 in boxes:
        u0, u1, v0, v1 = (round((value + 2.0) / 0.05) for value in (x0, x1, y0, y1))
        costs[v0:v1, u0:u1] = LETHAL_OBSTACLE
    return Costmap(
        costs=costs, resolution=0.05, origin=(-2.0, -2.0), inscribed_radius=0.3, cost_scaling_factor=4.0
    )


def line(start: tuple[float, float], end: tuple[float, float]) -> Array:
    points = np.linspace(start, end, 40)
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    return np.column_stack([points, np.full(len(points), yaw)])


def touches(costmap: Costmap, pose: Pose2) -> bool:
    at = float(pose.x), float(pose.y), float(pose.yaw)
    return outline_cost(costmap.costs, LONG, at, costmap.frame) == LETHAL_OBSTACLE


def driven(costmap: Costmap, start: Pose2, path: Array, seconds: float = 30.0) -> list[Pose2]:
    """Drive as a base does that follows commands at once; return where it was."""
    maneuver = Maneuver(footprint=LONG)
    assert maneuver.begin(costmap, start, path)
    poses, velocity = [start], (0.0, 0.0)
    for _ in range(round(seconds / DT)):
        command = maneuver.command(poses[-1], velocity, costmap, DT)
        if command is None:
            break
        velocity = command
        poses.append(poses[-1] @ Pose2(command[0] * DT, 0.0, command[1] * DT))
    assert not maneuver.active
    return poses


AISLE = ((-2.0, 2.0, 0.5, 1.0), (-2.0, 2.0, -1.0, -0.5))
SITUATIONS = {
    "askew in an aisle that it cannot turn in": (hall(*AISLE), Pose2(0.0, 0.0, 0.25), line((0, 0), (1.5, 0))),
    "nose to somebody beside the way": (
        hall((0.5, 0.9, -0.6, 0.1)),
        Pose2(0.0, 0.0, -0.1),
        line((0.0, 0.45), (1.5, 0.45)),
    ),
    "its back corner beside a post": (
        hall((-0.5, -0.3, 0.35, 0.6)),
        Pose2(0.0, 0.0, 0.0),
        line((0.0, 0.0), (0.7, -0.9)),
    ),
    "the way on is behind it": (hall(*AISLE[:1]), Pose2(0.0, 0.0, 0.0), line((0, 0), (-1.5, -0.5))),
    "somebody stands along its side, as close as can be": (
        hall((-0.3, 0.1, -0.6, -0.27)),
        Pose2(0.0, 0.0, 0.0),
        line((0.0, 0.3), (-1.5, 0.9)),
    ),
    "it touches something already": (
        hall((0.4, 0.8, -0.1, 0.3)),
        Pose2(0.0, 0.0, 0.0),
        line((0.0, -0.5), (1.5, -0.5)),
    ),
}


@pytest.mark.parametrize("name", SITUATIONS)
def test_a_robot_gets_on_to_its_path_without_touching_anything_more(name: str) -> None:
    costmap, start, path = SITUATIONS[name]
    poses = driven(costmap, start, path)
    end = poses[-1]
    away = np.hypot(path[:, 0] - end.x, path[:, 1] - end.y)
    assert away.min() < 0.15
    heading = path[int(away.argmin()), 2] - end.yaw
    assert abs(math.remainder(heading, 2.0 * math.pi)) < 0.35
    if not touches(costmap, start):
        assert not any(touches(costmap, pose) for pose in poses)
    else:
        hits = [footprint_hits(costmap.costs, LONG, tuple(pose), costmap.frame) for pose in poses]
        assert max(hits) <= hits[0] * 1.3 + 10, "a cell or two deeper, by the samples of half a cell"
        assert hits[-1] == 0


def test_backwards_is_driven_only_where_it_must() -> None:
    costmap, start = hall(), Pose2(0.0, 0.0, 0.0)
    gears = [move.gear for move in find_maneuver(costmap, LONG, start, line((0.0, 0.0), (1.5, 0.0)))]
    assert gears == [1]
    costmap, start, path = SITUATIONS["nose to somebody beside the way"]
    assert -1 in [move.gear for move in find_maneuver(costmap, LONG, start, path)]


def test_there_may_be_no_way() -> None:
    boxed = hall(
        (0.5, 0.6, -0.5, 0.5), (-0.6, -0.5, -0.5, 0.5), (-0.6, 0.6, 0.35, 0.5), (-0.6, 0.6, -0.5, -0.35)
    )
    assert find_maneuver(boxed, LONG, Pose2(0.0, 0.0, 0.0), line((0.0, 0.0), (1.5, 0.0))) == []
    taken = hall((0.3, 2.0, -1.0, 1.0))  # the whole path ahead
    assert find_maneuver(taken, LONG, Pose2(-0.5, 0.0, 0.0), line((-0.5, 0.0), (1.5, 0.0))) == []


def test_a_reach_of_zero_forbids_it() -> None:
    way = line((0.0, 0.0), (1.5, 0.0))
    assert find_maneuver(hall(), LONG, Pose2(0.0, 0.0, 0.0), way, ManeuverConfig(reach=0.0)) == []


def test_a_maneuver_ends_when_somebody_steps_into_it() -> None:
    costmap = hall()
    maneuver = Maneuver(footprint=LONG)
    assert maneuver.begin(costmap, Pose2(0.0, 0.0, 0.0), line((0.0, 0.0), (1.5, 0.0)))
    assert maneuver.command(Pose2(0.0, 0.0, 0.0), (0.0, 0.0), costmap, DT) is not None
    blocked = hall((0.46, 0.8, -0.3, 0.3))
    assert maneuver.command(Pose2(0.0, 0.0, 0.0), (0.1, 0.0), blocked, DT) is None
    assert not maneuver.active


def test_poses_of_a_move_lie_a_cell_and_a_half_apart_also_on_a_finer_costmap() -> None:
    """Or every move would be half as long, and the way as dear to find as by four times as many."""
    for resolution in (0.05, 0.025):
        n = round(4.0 / resolution)
        costmap = Costmap(costs=np.zeros((n, n), dtype=np.uint8), resolution=resolution, origin=(-2.0, -2.0))
        moves = find_maneuver(costmap, LONG, Pose2(0.0, 0.0, 0.0), line((0.5, 0.0), (1.5, 0.0)))
        assert [move.gear for move in moves] == [1]
        between = np.hypot(*np.diff(moves[0].poses[:, :2], axis=0).T)
        assert between == pytest.approx(np.full(len(between), 0.075))


@pytest.mark.parametrize(("limit", "most"), [(None, 0.2), (0.1, 0.1), (0.5, 0.2)])
def test_a_maneuver_is_driven_no_faster_than_its_speed_and_the_limit(
    limit: float | None, most: float
) -> None:
    maneuver, at, velocity, speeds = Maneuver(footprint=LONG), Pose2(0.0, 0.0, 0.0), (0.0, 0.0), []
    maneuver.speed_limit = limit
    assert maneuver.begin(hall(), at, line((0.0, 0.0), (0.5, 0.0)))
    while (command := maneuver.command(at, velocity, hall(), DT)) is not None:
        velocity = command
        at = at @ Pose2(command[0] * DT, 0.0, command[1] * DT)
        speeds.append(command[0])
    assert max(speeds) == pytest.approx(most)
    assert np.diff(speeds, prepend=0.0).max() <= 0.5 * DT + 1e-9, "speeding up as it may"
    assert speeds[-1] < 0.19, "slower at the end"
    assert at.x == pytest.approx(0.5, abs=0.1)
