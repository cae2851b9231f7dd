"""Those who walk to and fro in environments, and give way to robots as a scenario's obstacles do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from twin.envs.kernels import Ints
from twin.geometry import Array, Pose2
from twin.navigation._jit import jit


@dataclass(frozen=True, kw_only=True)
class WalkerConfig:
    """A box on the floor that walks along a route and back; its sides stay along the world's axes."""

    size: tuple[float, float, float]
    """Extent along x, y and z [m]."""
    route: tuple[tuple[float, float], ...]
    """x, y of its points, two at least [m]."""
    speed: float = 0.5
    """Of walking; in an episode up to `pace` more or less [m/s]."""
    pace: float = 0.3
    """Relative."""
    yields_within: float = 1.0
    """It stops before a robot whose root link is this near to it [m] ..."""
    patience: float = 3.0
    """... and turns back when that has lasted so long [s]."""

    @property
    def knots(self) -> Array:
        """How far along the route each of its points is, shape (points,) [m]."""
        return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(self.route, axis=0).T))))


class Routes(NamedTuple):
    """Of w walkers with p points at most; the last one stands for those that a route lacks."""

    points: Array
    """x, y, shape (w, p, 2) [m]."""
    knots: Array
    """How far along each is, shape (w, p) [m]."""
    half: Array
    """Half of the sizes along x and y, shape (w, 2) [m]."""
    yields_within: Array
    """Shape (w,) [m]."""
    patience: Array
    """Shape (w,) [s]."""


class Walks(NamedTuple):
    """Where w walkers of n environments are; each has shape (n, w)."""

    along: Array
    """Their routes [m]."""
    direction: Ints
    """1 or -1."""
    speed: Array
    """[m/s]"""
    waited: Array
    """[s]"""


class Walkers:
    """The walkers of n environments."""

    def __init__(self, walkers: Sequence[WalkerConfig], n: int) -> None:
        self._walkers = tuple(walkers)
        w, p = len(walkers), max((len(walker.route) for walker in walkers), default=2)
        self.routes = Routes(
            np.zeros((w, p, 2)), np.zeros((w, p)), np.zeros((w, 2)), np.zeros(w), np.zeros(w)
        )
        for k, walker in enumerate(walkers):
            missing = p - len(walker.route)
            self.routes.points[k] = [*walker.route, *[walker.route[-1]] * missing]
            self.routes.knots[k] = [*walker.knots, *[walker.knots[-1]] * missing]
            self.routes.half[k] = np.array(walker.size[:2]) / 2.0
            self.routes.yields_within[k], self.routes.patience[k] = walker.yields_within, walker.patience
        self.walks = Walks(np.zeros((n, w)), np.ones((n, w), np.int64), np.zeros((n, w)), np.zeros((n, w)))

    def begin(self, i: int, numbers: Array) -> None:
        """Let those of environment `i` begin somewhere on their ways; `numbers` in [0, 1), shape (w, 3)."""
        for k, (walker, (place, way, pace)) in enumerate(zip(self._walkers, numbers.tolist(), strict=True)):
            self.walks.along[i, k] = place * walker.knots[-1]
            self.walks.direction[i, k] = 1 if way < 0.5 else -1
            self.walks.speed[i, k] = walker.speed * (1.0 + walker.pace * (2.0 * pace - 1.0))
            self.walks.waited[i, k] = 0.0

    def poses(self, i: int) -> list[Pose2]:
        """Return where those of environment `i` are."""
        return [
            Pose2(*_place(self.routes, k, float(self.walks.along[i, k])), 0.0)
            for k in range(len(self._walkers))
        ]

    def walk(self, elapsed: float, robots: Array, positions: Array) -> None:
        """Let all walk for some time.

        Args:
            elapsed: [s]
            robots: x, y first, shape (n, 2 or more) [m].
            positions: x, y of their bodies are written, shape (n, w, 3) [m].
        """
        _walk(elapsed, robots, self.routes, self.walks, positions)


@jit
def _walk(elapsed: float, robots: Array, routes: Routes, walks: Walks, positions: Array) -> None:
    """As `twin.runtime.obstacles.Walker.walk` does for one walker and robots without an outline."""
    last = routes.knots.shape[1] - 1
    for i in range(walks.along.shape[0]):
        for k in range(walks.along.shape[1]):
            here, end = walks.along[i, k], routes.knots[k, last]
            there = min(max(here + walks.direction[i, k] * walks.speed[i, k] * elapsed, 0.0), end)
            then = _gap(routes, k, there, robots[i, 0], robots[i, 1])
            if then < routes.yields_within[k] and then < _gap(routes, k, here, robots[i, 0], robots[i, 1]):
                walks.waited[i, k] += elapsed
                if walks.waited[i, k] >= routes.patience[k]:
                    walks.waited[i, k] = 0.0
                    walks.direction[i, k] = -walks.direction[i, k]
                continue
            walks.waited[i, k], walks.along[i, k] = 0.0, there
            if there == 0.0 or there == end:
                walks.direction[i, k] = 1 if there == 0.0 else -1
            positions[i, k, 0], positions[i, k, 1] = _place(routes, k, there)


@jit
def _gap(routes: Routes, k: int, along: float, x: float, y: float) -> float:
    """Return how far a point is from a walker [m]."""
    here_x, here_y = _place(routes, k, along)
    aside_x = max(abs(x - here_x) - routes.half[k, 0], 0.0)
    aside_y = max(abs(y - here_y) - routes.half[k, 1], 0.0)
    return math.sqrt(aside_x * aside_x + aside_y * aside_y)


@jit
def _place(routes: Routes, k: int, along: float) -> tuple[float, float]:
    """Return the point so far along a route [m]."""
    for j in range(1, routes.knots.shape[1]):
        start, end = routes.knots[k, j - 1], routes.knots[k, j]
        if along <= end and end > start:
            share = (along - start) / (end - start)
            x, y = routes.points[k, j - 1, 0], routes.points[k, j - 1, 1]
            return x + share * (routes.points[k, j, 0] - x), y + share * (routes.points[k, j, 1] - y)
    return routes.points[k, -1, 0], routes.points[k, -1, 1]
