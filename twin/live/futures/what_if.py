"""What is asked of the futures of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

from twin.errors import SimulationError
from twin.geometry import Pose2

MOST_FUTURES = 1000
LONGEST_S = 3600.0


@dataclass(frozen=True, kw_only=True)
class WhatIf:
    """What is asked; without `set` and `goal` the first future is what comes if nothing does from outside."""

    n: int = 8
    """How many futures. The first has the noise that the run will have, each of the others its own."""
    horizon: float = 60.0
    """How far they go at most [s]."""
    robot: str = ""
    """Who is watched; empty: the only one."""
    goal: tuple[float, float, float] | None = None
    """x [m], y [m] and yaw [rad] in the map to which the robot is sent now, instead of what it is at."""
    set: tuple[str, ...] = ()
    """`NODE.PARAMETER=VALUE`, or a fault by one number: `friction=0.5`. Holds in all futures from now on."""

    def __post_init__(self) -> None:
        """Refuse numbers that mean nothing.

        Raises:
            SimulationError: With what would be valid.
        """
        if not 1 <= self.n <= MOST_FUTURES:
            raise SimulationError(f"--n {self.n}: must be from 1 to {MOST_FUTURES}")
        if not 0.0 < self.horizon <= LONGEST_S:
            raise SimulationError(
                f"--horizon {self.horizon:g}: must be more than 0 and at most {LONGEST_S:g} s"
            )
        if self.goal is not None and (len(self.goal) != 3 or not all(map(math.isfinite, self.goal))):
            raise SimulationError(f"--goal {','.join(map(str, self.goal))}: must be three finite numbers")
        for word in self.set:
            if "=" not in word.lstrip("="):
                raise SimulationError(f"--set {word}: must be KEY=VALUE, such as friction=0.5")

    @property
    def goal_pose(self) -> Pose2 | None:
        """The goal."""
        return None if self.goal is None else Pose2(*self.goal)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return what `to_dict` gave; JSON has no tuples."""
        goal = values["goal"]
        return cls(**{**values, "set": tuple(values["set"]), "goal": goal and tuple(goal)})


def parsed_goal(text: str) -> tuple[float, float, float]:
    """Return the numbers of `x,y,yaw` [m, m, rad]; raises SimulationError for anything else."""
    try:
        x, y, yaw = map(float, text.split(","))
    except ValueError:
        raise SimulationError(
            f"--goal {text}: must be x,y,yaw in metres and radians, such as --goal 2.5,-1,1.57"
        ) from None
    return x, y, yaw
