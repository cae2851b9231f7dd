"""Checks on a map that a robot makes: its walls are where the true ones are, and nothing is missing."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated

import numpy as np

from twin.geometry import Array
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.parameters import Fraction, Metres, Positive
from twin.scenario.checks.check import CheckResult, RobotCheck, RobotCheckConfig, at_least_one
from twin.scenario.checks.map_truth import FREE_TO, MapTruth, wall_cells
from twin.scenario.observation import CheckContext, Observation


class MapAccuracyConfig(RobotCheckConfig):
    """The walls of the map are where the true ones are, and the true ones where those of the map are.

    Distances are those of occupied cells, as squares, to the nearest true surface, and of the surfaces
    that the map shows to its nearest occupied cell; the worse of both counts.
    """

    mean: Annotated[Metres, Positive] | None = None
    """Largest mean distance [m]."""
    p95: Annotated[Metres, Positive] | None = None
    """Largest distance of 95 % of them [m]."""
    _has_a_limit = at_least_one("mean", "p95")


class MapCoverageConfig(RobotCheckConfig):
    """Nothing is missing on the map of what the robot can get to."""

    floor: Annotated[float, Fraction] | None = None
    """Least part of the floor that the robot can cover that is free on the map."""
    walls: Annotated[float, Fraction] | None = None
    """Least part of the surfaces beside that floor that have an occupied cell within `within`."""
    within: Annotated[Metres, Positive] = 0.1
    """Distance from a true surface to the nearest occupied cell [m]."""
    _has_a_limit = at_least_one("floor", "walls")


class _MapCheck(RobotCheck):
    """Keeps the last map, and holds it against the truth at the end."""

    unit = ""
    _map: OccupancyMap | None = None

    def __init__(self, name: str, config: RobotCheckConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._surroundings = context.surroundings.get(self._robot)

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._at_s = observation.time_s
        self._map = observation.robots[self._robot].map

    @abstractmethod
    def _measures(self, grid: OccupancyMap, truth: MapTruth) -> Iterator[tuple[str, float, float, bool]]:
        """Yield what was measured: its text, value and limit, and whether it passed; the worst one last."""

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is the first measure that fails, else the last one."""
        value: float | None = None
        limit: float | None = None
        margin: float | None = None
        if self._surroundings is None or not self._surroundings.solids:
            reason = "there is nothing that a lidar could see"
        elif self._map is None:
            reason = f"{self._robot} made no map"
        else:
            measures = list(self._measures(self._map, MapTruth(self._surroundings)))
            failed = [measure for measure in measures if not measure[3]]
            text, value, limit, passed = (failed or measures)[0 if failed else -1]
            reason, margin = "" if passed else text, abs(limit - value) * (1 if passed else -1)
        return self._judged(reason, value, limit, self.unit, self._at_s, margin)


class MapAccuracy(_MapCheck):
    """Measures distances between occupied cells and true surfaces, both ways."""

    Config = MapAccuracyConfig
    config: MapAccuracyConfig
    unit = "m"

    def _measures(self, grid: OccupancyMap, truth: MapTruth) -> Iterator[tuple[str, float, float, bool]]:
        both = truth.distances_of_cells(grid), truth.distances_of_walls(grid)
        mean = max(_mean(distances) for distances in both)
        p95 = max(_p95(distances) for distances in both)
        cells, walls = (f"mean {_mean(part):.3f} m, 95 % within {_p95(part):.3f} m" for part in both)
        found = f"occupied cells are off the walls by: {cells}; walls off occupied cells by: {walls}"
        for value, limit in ((mean, self.config.mean), (p95, self.config.p95)):
            if limit is not None:
                yield found, value, limit, value <= limit


class MapCoverage(_MapCheck):
    """Measures which part of the reachable floor and of its walls is on the map."""

    Config = MapCoverageConfig
    config: MapCoverageConfig

    def _measures(self, grid: OccupancyMap, truth: MapTruth) -> Iterator[tuple[str, float, float, bool]]:
        config = self.config
        if config.walls is not None:
            from scipy.spatial import cKDTree  # takes a third of a second to import

            cells, points = wall_cells(grid), truth.wall_points
            share = 0.0
            if len(cells) and len(points):
                share = float((cKDTree(cells).query(points)[0] <= config.within).mean())
            yield f"{share:.1%} of the walls are on the map", share, config.walls, share >= config.walls
        if config.floor is not None:
            values = grid.value_at(truth.floor_points)
            share = float(((values >= 0) & (values <= FREE_TO)).mean()) if values.size else 0.0
            yield f"{share:.1%} of the floor is free on the map", share, config.floor, share >= config.floor


def _mean(distances: Array) -> float:
    return float(distances.mean()) if distances.size else math.inf


def _p95(distances: Array) -> float:
    return float(np.percentile(distances, 95.0, method="higher")) if distances.size else math.inf
