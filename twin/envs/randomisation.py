"""What differs from episode to episode, and where those numbers come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twin.errors import GymError, Problem
from twin.geometry import Array
from twin.sim.noise import NoiseStream

_ROBOT, _WALKS, _LAYOUT = 0, 1, 2
"""Ticks of an episode's uniform numbers: of robot, of walkers, and from which on of where things are."""
_CONSTANTS, _STEPS = 0, 1
"""Ticks of its normal numbers: of what stays, and from which on of what differs in each step."""
_NUMBERS = 6


@dataclass(frozen=True, kw_only=True)
class Randomisation:
    """Domain randomisation: how far an episode's robot may differ from the one that its controller knows.

    Every number is drawn anew for each episode, uniformly and independently of the others.
    """

    mass: float = 0.1
    """Of the robot, relative, either way: masses and inertias of all links grow by the same factor."""
    friction: float = 0.2
    """Of the driven wheels on the floor, relative, either way."""
    wheel_radius: float = 0.01
    """Of all driven wheels, relative, either way."""
    wheel_mismatch: float = 0.001
    """Of left against right wheels, relative, either way: it makes dead reckoning turn."""
    latency: tuple[float, float] = (0.0, 0.06)
    """From a wheel command to its start, least and most [s]; it counts in whole control periods."""
    lidar_noise: tuple[float, float] = (0.005, 0.02)
    """Standard deviation of each range, least and most [m]."""

    def __post_init__(self) -> None:
        problems = [
            Problem(f"randomisation.{name} is {getattr(self, name)}; valid: 0 up to below 1")
            for name in ("mass", "friction", "wheel_radius", "wheel_mismatch")
            if not 0.0 <= getattr(self, name) < 1.0
        ]
        problems += [
            Problem(f"randomisation.{name} is {low:g} to {high:g}; valid: two numbers from 0 on, least first")
            for name, (low, high) in (("latency", self.latency), ("lidar_noise", self.lidar_noise))
            if not 0.0 <= low <= high < np.inf
        ]
        if problems:
            raise GymError(problems)


NONE = Randomisation(
    mass=0.0, friction=0.0, wheel_radius=0.0, wheel_mismatch=0.0, latency=(0.0, 0.0), lidar_noise=(0.01, 0.01)
)
"""The robot is as its file says; its lidar's noise stays."""


class RobotDraw(NamedTuple):
    """The robot of an episode."""

    mass: float
    """Factor."""
    friction: float
    """Factor."""
    radius_left: float
    """Factor."""
    radius_right: float
    """Factor."""
    latency: float
    """[s]"""
    lidar_noise: float
    """[m]"""


class Episode:
    """The random numbers of one episode of one environment.

    They come from a counter-based generator that is keyed by the environment's seed and the episode's number,
    and read at a step: they depend neither on other environments nor on what was drawn before.
    """

    def __init__(self, seed: int, number: int) -> None:
        self.seed, self.number = seed, number
        self._stream = NoiseStream(seed, f"episode/{number}")

    def robot(self, spread: Randomisation) -> RobotDraw:
        """Return the robot of this episode."""
        u = self._stream.uniform(_ROBOT, _NUMBERS)
        either = 2.0 * u - 1.0
        radius, mismatch = spread.wheel_radius * either[2], spread.wheel_mismatch * either[3]
        return RobotDraw(
            mass=1.0 + spread.mass * either[0],
            friction=1.0 + spread.friction * either[1],
            radius_left=1.0 + radius + mismatch / 2.0,
            radius_right=1.0 + radius - mismatch / 2.0,
            latency=_between(spread.latency, u[4]),
            lidar_noise=_between(spread.lidar_noise, u[5]),
        )

    def constants(self, n: int) -> Array:
        """Return the first `n` standard normal numbers that stay for the episode, shape (n,)."""
        return self._stream.normal(_CONSTANTS, n)

    def walks(self, walkers: int) -> Array:
        """Return three numbers in [0, 1) for each walker, shape (walkers, 3)."""
        return self._stream.uniform(_WALKS, 3 * walkers).reshape(walkers, 3)

    def uniform(self, attempt: int, n: int) -> Array:
        """Return `n` numbers in [0, 1) for the `attempt`-th try (>= 0) to find places, shape (n,)."""
        return self._stream.uniform(_LAYOUT + attempt, n)

    def normal(self, step: int, n: int) -> Array:
        """Return `n` standard normal numbers of a step (>= 0), shape (n,)."""
        return self._stream.normal(_STEPS + step, n)


def _between(limits: tuple[float, float], share: float) -> float:
    low, high = limits
    return low + (high - low) * float(share)
