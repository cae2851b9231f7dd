"""The covariance of Monte Carlo localisation, over maps that are each wrong in another way."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy import ndimage, stats

from tests.navigation.localisation import test_amcl
from tests.navigation.localisation.test_amcl import BACK, CLUTTER, GUESS, WAYPOINTS, localise
from twin.geometry import Pose2, wrap_angle
from twin.navigation.localisation.amcl import Amcl
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.evidence import ScanError, ScanEvidence
from twin.navigation.maps.occupancy_map import OccupancyMap

SETTLED = 10


def edges(box: Any) -> np.ndarray:
    x0, y0, x1, y1 = box
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def redrawn(hall: Any, seed: int) -> Any:
    """Return the hall with all its edges moved by up to a cell: each seed has other faults on its map."""
    random = np.random.default_rng(seed)
    other = type(hall)()
    other.boxes = tuple(tuple(np.array(box) + random.uniform(-0.05, 0.05, 4)) for box in hall.boxes)
    outer = np.array((0.018, 0.031, 19.973, 13.962)) + random.uniform(-0.05, 0.05, 4)
    other.segments = np.concatenate([edges(outer), *(edges(box) for box in other.boxes)])
    return other


def drawn(hall: Any, resolution: float, yaw: float) -> OccupancyMap:
    """Return the map on which every cell is occupied that a wall touches, and all that is behind one."""
    origin = Pose2(3.0, -7.0, yaw) if yaw else Pose2(-0.5, -0.5, 0.0)
    size = (round(26.0 / resolution),) * 2 if yaw else (round(15.0 / resolution), round(21.0 / resolution))
    walls = np.zeros(size, dtype=bool)
    for a, b in hall.segments:
        steps = np.linspace(0.0, 1.0, int(np.hypot(*(b - a)) / 0.004) + 2)[:, None]
        cells = np.floor(origin.inverse().apply(a + steps * (b - a)) / resolution).astype(int)
        walls[cells[:, 1], cells[:, 0]] = True
    rooms, _ = ndimage.label(~walls)
    at = np.floor(origin.inverse().apply(np.array([WAYPOINTS[0]])) / resolution).astype(int)[0]
    data = np.where(rooms == rooms[at[1], at[0]], 0, 100).astype(np.int8)
    return OccupancyMap(data=data, resolution=resolution, origin=origin)


def spinning(_waypoints: object) -> Iterator[Pose2]:
    for i in range(300):
        yield Pose2(4.9 + 0.001 * i, 5.2, wrap_angle(0.1 * i))


DRIVES: dict[str, dict[str, Any]] = {
    "about": {"way": WAYPOINTS + BACK[1:4]},
    "clutter": {"way": WAYPOINTS, "clutter": np.concatenate([edges(box) for box in CLUTTER])},
    "straight": {"way": ((1.2, 1.5), (1.3, 12.5), (1.2, 1.5))},
    "fine map": {"way": WAYPOINTS, "resolution": 0.025},
    "map askew": {"way": WAYPOINTS, "yaw": 0.3},
    "spin": {"way": ((4.9, 5.2),)},
}


@pytest.mark.parametrize(("name", "places"), [(name, 1 if name == "spin" else 5) for name in DRIVES])
def test_nees_is_that_of_an_honest_filter(
    hall: Any, monkeypatch: pytest.MonkeyPatch, name: str, places: int
) -> None:
    """The map's faults are the same for some metres, so a drive is a few independent draws and no more."""
    found = []
    for seed in range(3):
        drive = {"resolution": 0.05, "yaw": 0.0, "clutter": None, **DRIVES[name]}
        room = redrawn(hall, seed)
        amcl = Amcl(AmclConfig(), drawn(room, drive["resolution"], drive["yaw"]), seed)
        amcl.initialise(Pose2(*drive["way"][0], 0.0), GUESS)
        if name == "spin":
            monkeypatch.setattr(test_amcl, "drive", spinning)
        run = localise(room, amcl, drive["way"], clutter=drive["clutter"], seed=seed)
        found.append(float(run.nees[SETTLED:].mean()))
    draws = 3 * len(found) * places
    low, high = stats.chi2.ppf((0.005, 0.995), draws) / (len(found) * places)
    assert low < np.mean(found) < high, found


def fit(noise: float, fault: float, random: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Return residuals, normals and points of a scan in a room of eight walls, and the error of its fit."""
    angles = np.sort(random.uniform(-math.pi, math.pi, 60))
    wall = np.floor((angles + math.pi) / (math.pi / 4.0)).astype(int) % 8
    towards = (wall + 0.5) * math.pi / 4.0 - math.pi
    normals = -np.column_stack([np.cos(towards), np.sin(towards)])
    reach = (3.0 + 0.5 * wall) / np.cos(angles - towards)
    points = np.column_stack([np.cos(angles), np.sin(angles)]) * reach[:, None]
    rows = np.column_stack([normals, points[:, 0] * normals[:, 1] - points[:, 1] * normals[:, 0]])
    residuals = random.normal(0.0, noise, 60) + random.normal(0.0, fault, 8)[wall]
    error = -np.linalg.lstsq(rows, residuals, rcond=None)[0]
    return residuals + rows @ error, normals, points, error


@pytest.mark.parametrize(("noise", "fault"), [(0.01, 0.02), (0.02, 0.0), (0.01, 0.005)])
def test_noise_of_beams_and_faults_of_the_map_are_told_apart(noise: float, fault: float) -> None:
    random = np.random.default_rng(1)
    evidence = ScanEvidence(0.5, 0.05)
    nees = []
    for _ in range(600):
        *seen, error = fit(noise, fault, random)
        told = evidence.learn(*seen, 0.05)
        assert told is not None
        nees.append(error @ np.linalg.solve(told.covariance, error))
    assert evidence.noise == pytest.approx(noise, rel=0.1)
    assert evidence.fault == pytest.approx(fault, rel=0.25, abs=0.004)
    assert 2.6 < np.mean(nees[200:]) < 3.4


def test_one_wall_tells_no_pose() -> None:
    evidence, points = (
        ScanEvidence(0.5, 0.05),
        np.column_stack([np.full(20, 2.0), np.linspace(-1.0, 1.0, 20)]),
    )
    assert evidence.learn(np.full(20, 0.01), np.tile([-1.0, 0.0], (20, 1)), points, 0.05) is None
    assert evidence.exponent == 0.5


def test_the_same_faults_seen_again_teach_nothing() -> None:
    scan = np.diag([1e-4, 1e-4, 1e-6])
    all_fault, no_fault = (ScanError(covariance=scan, fault_share=share) for share in (1.0, 0.0))
    vague = np.diag([1.0, 1.0, 1.0])
    for told in (all_fault, no_fault):
        assert told.joined(vague) == pytest.approx(scan, rel=0.02)
    assert no_fault.joined(scan) == pytest.approx(0.5 * scan)
    assert all_fault.joined(scan) == pytest.approx(scan)
    # What the robot knew better before, of what lies along a corridor, it keeps.
    corridor = np.diag([1e-4, 1.0, 1e-6])
    known = np.diag([1e-2, 1e-4, 1e-2])
    joined = ScanError(covariance=corridor, fault_share=0.9).joined(known)
    assert joined[1, 1] == pytest.approx(1e-4, rel=0.01)
    assert joined[0, 0] == pytest.approx(1e-4, rel=0.02)
