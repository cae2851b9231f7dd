"""Small worlds, so that a test is short."""

from __future__ import annotations

import pytest

from twin.geometry import Pose2
from twin_benchmarks.barn.worlds import BarnSet, BarnWorld, Point


def world(number: int, *obstacles: Point, length: float = 10.0) -> BarnWorld:
    return BarnWorld(id=number, obstacles=obstacles, path_length=length)


def rules_of(*worlds: BarnWorld, timeout_s: float = 20.0) -> BarnSet:
    return BarnSet(
        worlds=worlds,
        radius=0.075,
        height=0.5,
        start=Pose2(-2.25, 3.0, 1.57),
        goal=(-2.25, 13.0),
        goal_radius=1.0,
        timeout_s=timeout_s,
    )


@pytest.fixture
def slalom() -> BarnWorld:
    """Two walls with a gap of 0.9 m each, not in line."""
    left = [(-4.4 + 0.15 * i, 6.0) for i in range(18)]
    right = [(-2.9 + 0.15 * i, 8.5) for i in range(19)]
    return world(1, *left, *right, length=10.6)
