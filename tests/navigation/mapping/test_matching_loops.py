"""The loops of the scan matcher: branch and bound against trying everything, alignment against algebra."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.navigation.mapping.alignment import Lines
from twin.navigation.mapping.correlation import APART, CorrelationGrid, Window

CELL, DEVIATION = 0.1, 0.12


def smeared(points: Array) -> dict[tuple[int, int], float]:
    """Return how well each cell lies on the points, 0 ... 255: a Gaussian about each one's cell, rounded."""
    reach, values = math.ceil(2.0 * DEVIATION / CELL), dict[tuple[int, int], float]()
    for column, row in np.floor(points / CELL).astype(int).tolist():
        for i, j in itertools.product(range(-reach, reach + 1), repeat=2):
            value = round(255.0 * math.exp(-0.5 * (i * i + j * j) * CELL**2 / DEVIATION**2))
            cell = column + i, row + j
            values[cell] = max(values.get(cell, 0), value)
    return values


def tried(
    known: Array, seen: Array, guess: Pose2, window: Window, turns: Array, apart: Pose2 | None
) -> tuple[float, Pose2, float]:
    """Return punished response, pose and response of the best of all places in the window."""
    values, best = smeared(known), (0.0, guess, 0.0)
    reach = round(window.half_width / CELL)
    for turn in turns:
        cells = np.floor((guess @ Pose2(0.0, 0.0, turn)).apply(seen) / CELL).astype(int)
        for i, j in itertools.product(range(-reach, reach + 1), repeat=2):
            if apart is not None:
                off = math.hypot(guess.x + i * CELL - apart.x, guess.y + j * CELL - apart.y)
                if off < APART:
                    continue
            response = sum(values.get((u + i, v + j), 0) for u, v in cells.tolist()) / 255.0 / len(seen)
            way = max(1.0 - 0.2 * (i * i + j * j) * CELL**2 / window.distance_variance, 0.5)
            angle = max(1.0 - 0.2 * turn**2 / window.angle_variance, 0.9)
            if response * way * angle > best[0] + 1e-12:
                pose = Pose2(guess.x + i * CELL, guess.y + j * CELL, guess.yaw + turn)
                best = response * way * angle, pose, response
    return best


@pytest.mark.parametrize("levels", [1, 4])
@pytest.mark.parametrize("apart", [None, Pose2(0.3, 0.2, 0.0)])
@pytest.mark.parametrize("variances", [(0.3, 0.05), (math.inf, math.inf)])
def test_branch_and_bound_finds_what_trying_everything_finds(
    levels: int, apart: Pose2 | None, variances: tuple[float, float]
) -> None:
    random = np.random.default_rng(4)
    known = random.uniform(-2.0, 2.0, (25, 2))
    truth, guess = Pose2(0.43, -0.28, 0.55), Pose2(0.15, 0.1, 0.5)
    seen = truth.inverse().apply(known[:18]) + random.normal(0.0, 0.02, (18, 2))
    window = Window(
        half_width=1.0 if apart is None else 1.8,
        half_angle=0.1,
        distance_variance=variances[0],
        angle_variance=variances[1],
    )
    step = CELL / math.sqrt(np.max(np.sum(seen**2, axis=1)))  # the farthest point moves by a cell
    half = math.ceil(0.1 / step)
    turns = np.arange(-half, half + 1) * step
    grid = CorrelationGrid(known, CELL, DEVIATION, levels)
    punished, pose, response = tried(known, seen, guess, window, turns, apart)
    found = grid.search(seen, guess, window, apart_from=apart)
    assert found is not None
    assert found.response == pytest.approx(response)
    assert found.pose == pytest.approx(pose)
    assert grid.search(seen, guess, window, least=punished + 1e-6, apart_from=apart) is None
    assert grid.search(seen, guess, window, least=punished - 1e-6, apart_from=apart) is not None
    assert grid.search(np.zeros((0, 2)), guess, window) is None


def room(*, corridor: bool = False) -> tuple[Array, Array, Array]:
    """Pieces of line every 0.2 m along the walls of 6 x 4 m: middles, normals inwards, half lengths."""
    x, y = np.arange(-2.9, 3.0, 0.2), np.arange(-1.9, 2.0, 0.2)
    walls = [
        (np.column_stack([x, np.full_like(x, -2.0)]), (0.0, 1.0)),
        (np.column_stack([x, np.full_like(x, 2.0)]), (0.0, -1.0)),
        (np.column_stack([np.full_like(y, -3.0), y]), (1.0, 0.0)),
        (np.column_stack([np.full_like(y, 3.0), y]), (-1.0, 0.0)),
    ][: 2 if corridor else 4]
    points = np.concatenate([middles for middles, _ in walls])
    normals = np.concatenate([np.tile(normal, (len(middles), 1)) for middles, normal in walls])
    return points, normals, np.full(len(points), 0.1)


def scanned(points: Array, normals: Array, pose: Pose2) -> tuple[Array, Array]:
    return pose.inverse().apply(points), Pose2(0.0, 0.0, -pose.yaw).apply(normals)


NO_PRIOR = np.zeros((3, 3))
TRUTH, START = Pose2(0.4, -0.3, 0.5), Pose2(0.5, -0.36, 0.53)


@pytest.mark.parametrize("with_normals", [True, False])
def test_a_scan_is_moved_onto_the_lines_that_it_is_of(with_normals: bool) -> None:
    points, normals, lengths = room()
    seen, looks = scanned(points, normals, TRUTH)
    found = Lines(points, normals, lengths).align(seen, looks * with_normals, START, START, NO_PRIOR, 0.03)
    assert found.pose == pytest.approx(TRUTH, abs=1e-4)
    assert found.inliers == 1.0
    # Each point tells its distance along its normal: the Gauss-Newton information of point to line.
    away = points - TRUTH[:2]
    rows = np.column_stack([normals, away[:, 0] * normals[:, 1] - away[:, 1] * normals[:, 0]])
    assert found.information == pytest.approx(rows.T @ rows / 0.03**2, rel=1e-2, abs=100.0)


def test_what_lies_on_no_line_does_not_count() -> None:
    points, normals, lengths = room()
    seen, looks = scanned(points, normals, TRUTH)
    seen[::2] += looks[::2] * 0.7  # somebody stands before every other piece
    found = Lines(points, normals, lengths).align(seen, looks, START, START, NO_PRIOR, 0.03)
    assert found.pose == pytest.approx(TRUTH, abs=1e-3)
    assert found.inliers == pytest.approx(0.5, abs=0.03)
    turned = Lines(points, normals, lengths).align(seen[1::2], -looks[1::2], START, START, np.eye(3), 0.03)
    assert turned.inliers == 0.0, "the other side of a wall is another wall"
    assert turned.pose == pytest.approx(START)


def test_a_corridor_leaves_along_it_what_the_prior_says() -> None:
    points, normals, lengths = room(corridor=True)
    seen, looks = scanned(points, normals, TRUTH)
    prior = Pose2(0.55, -0.1, 0.6 + 2.0 * math.pi)
    found = Lines(points, normals, lengths).align(seen, looks, START, prior, np.diag([4.0, 4.0, 4.0]), 0.03)
    assert found.pose == pytest.approx((0.55, TRUTH.y, TRUTH.yaw), abs=2e-3)
    held = Lines(points, normals, lengths).align(seen, looks, START, prior, np.eye(3) * 1e9, 0.03)
    assert held.pose == pytest.approx((0.55, -0.1, 0.6), abs=1e-3)


def test_without_lines_the_prior_is_all_there_is() -> None:
    points, normals, lengths = room()
    nothing = Lines(points, np.zeros_like(normals), lengths)
    seen, looks = scanned(points, normals, TRUTH)
    found = nothing.align(seen, looks, START, TRUTH, np.eye(3), 0.03)
    assert (found.pose, found.inliers) == (pytest.approx(TRUTH), 0.0)
    assert not found.information.any()
