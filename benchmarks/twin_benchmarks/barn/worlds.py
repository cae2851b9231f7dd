"""The worlds of BARN (Perille, Truong, Xiao, Stone 2020), read from a file of format `twin-barn/1`."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from twin.errors import nearest
from twin.files.reading import read_text
from twin.geometry import Pose2
from twin_benchmarks.errors import BenchmarkError

FORMAT = "twin-barn/1"
TOP_SPEED = 2.0
"""Of the robot that the optimal time is reckoned with [m/s]."""

Point = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class BarnWorld:
    """One world; coordinates are those of the challenge's Gazebo worlds [m]."""

    id: int
    obstacles: tuple[Point, ...]
    """Centres of the cylinders, the walls left, right and behind among them."""
    path_length: float
    """Of the optimal path from the start to the goal [m]."""
    path: tuple[Point, ...] = ()
    """That path, for pictures."""

    @property
    def optimal_time(self) -> float:
        """At top speed along the optimal path [s]."""
        return self.path_length / TOP_SPEED


@dataclass(frozen=True, kw_only=True)
class BarnSet:
    """Worlds and what they have in common."""

    worlds: tuple[BarnWorld, ...]
    radius: float
    """Of a cylinder [m]."""
    height: float
    """By which cylinders stand out of the floor [m]."""
    start: Pose2
    goal: Point
    goal_radius: float
    """[m]"""
    timeout_s: float

    def select(self, ids: Sequence[int] | None) -> BarnSet:
        """Return the set with only those worlds, in that order; None keeps all.

        Raises:
            BenchmarkError: An id is not in the set.
        """
        if ids is None:
            return self
        known = {world.id: world for world in self.worlds}
        for wanted in ids:
            if wanted not in known:
                raise BenchmarkError(
                    f"no world {wanted} in the file; {nearest(str(wanted), map(str, known))}"
                )
        chosen = tuple(known[wanted] for wanted in dict.fromkeys(ids))
        return replace(self, worlds=chosen)


def load(path: Path) -> BarnSet:
    """Read a file of worlds.

    Raises:
        BenchmarkError: It cannot be read, is of another format, or a value is missing or impossible.
    """
    try:
        data = json.loads(read_text(path))
    except OSError as fault:
        raise BenchmarkError(f"{path}: {fault.strerror}") from fault
    except ValueError as fault:
        raise BenchmarkError(f"{path}: not JSON: {fault}") from fault
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise BenchmarkError(f"{path}: not a file of BARN worlds; it must have `format` '{FORMAT}'")
    try:
        return _set(data)
    except (KeyError, TypeError, ValueError) as fault:
        what = f"'{fault.args[0]}' is missing" if isinstance(fault, KeyError) else str(fault)
        raise BenchmarkError(f"{path}: {what}") from fault


def _set(data: dict[str, Any]) -> BarnSet:
    obstacle = data["obstacle"]
    x, y, yaw = _numbers(data["start_pose_xyyaw"], 3, "start_pose_xyyaw")
    worlds = tuple(_world(entry) for entry in data["worlds"])
    if not worlds:
        raise ValueError("it holds no world")
    ids = [world.id for world in worlds]
    if len(set(ids)) < len(ids):
        raise ValueError("two worlds have the same id")
    return BarnSet(
        worlds=worlds,
        radius=_positive(obstacle["radius"], "obstacle.radius"),
        height=_positive(obstacle["height"] / 2.0 + obstacle.get("z", 0.0), "the cylinders' top"),
        start=Pose2(x, y, yaw),
        goal=_point(data["goal_xy"], "goal_xy"),
        goal_radius=_positive(data.get("goal_radius", 1.0), "goal_radius"),
        timeout_s=_positive(data.get("timeout_s", 100.0), "timeout_s"),
    )


def _world(entry: dict[str, Any]) -> BarnWorld:
    number = entry["id"]
    if isinstance(number, bool) or not isinstance(number, int):
        raise ValueError(f"the id of a world is a whole number, not {number!r}")
    at = f"world {number}"
    return BarnWorld(
        id=number,
        obstacles=tuple(_point(centre, f"{at}: an obstacle") for centre in entry["obstacles"]),
        path_length=_positive(entry["path_length"], f"{at}: path_length"),
        path=tuple(_point(point, f"{at}: a point of the path") for point in entry.get("path", ())),
    )


def _numbers(values: Any, count: int, what: str) -> list[float]:
    try:
        numbers = [float(value) for value in values]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{what} must be {count} numbers, not {values!r}")
    return numbers


def _point(values: Any, what: str) -> Point:
    x, y = _numbers(values, 2, what)
    return x, y


def _positive(value: Any, what: str) -> float:
    (number,) = _numbers([value], 1, what)
    if number <= 0.0:
        raise ValueError(f"{what} must be positive, not {number:g}")
    return number
