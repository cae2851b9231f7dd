"""Checks on sums over a run: distance driven, energy used."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import model_validator

from twin.geometry import Array
from twin.parameters import Joules, Metres, NotNegative, Positive
from twin.scenario.checks.check import NOTHING, CheckResult, RobotCheck, RobotCheckConfig
from twin.scenario.observation import Observation


class DrivenDistanceConfig(RobotCheckConfig):
    """The length of the true path lies between two bounds."""

    min: Annotated[Metres, NotNegative] | None = None
    """Shortest path [m]; 0 allows a robot to stand still, which else would be nothing to look at."""
    max: Annotated[Metres, Positive] | None = None
    """Longest path [m]."""

    @model_validator(mode="after")
    def _has_a_limit(self) -> DrivenDistanceConfig:
        if not self.min and self.max is None:
            raise ValueError("must have at least one of the keys min, max")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min ({self.min:g} m) must not exceed max ({self.max:g} m)")
        return self


class DrivenDistance(RobotCheck):
    """Adds up the steps of the base on the floor plane."""

    Config = DrivenDistanceConfig
    config: DrivenDistanceConfig
    _distance = 0.0
    _previous: Array | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        pose = observation.robots[self._robot].pose
        self._motion.take(pose)
        xy = pose.xyz[:2].copy()
        if self._previous is not None:
            self._distance += math.dist(xy, self._previous)
        self._previous, self._at_s = xy, observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        low, high = self.config.min, self.config.max
        too_short = low is not None and self._distance < low
        too_long = high is not None and self._distance > high
        reason = self._stood if low is None else ""
        if self._at_s is None:
            reason = "the run made no step"
        elif too_short or too_long:
            side = "less" if too_short else "more"
            reason = f"{self._robot} drove {self._distance:.2f} m, {side} than allowed"
        limit = low if too_short or high is None else high
        return self._judged(reason, self._distance, limit, "m", self._at_s)


class EnergyConfig(RobotCheckConfig):
    """The actuators do no more mechanical work than this.

    It is the force on each joint times the joint's true velocity, summed over the physics steps in which
    the product is positive: what a joint takes up while it brakes is lost.
    """

    max: Annotated[Joules, Positive]
    """Largest work [J]."""


class Energy(RobotCheck):
    """Keeps the work done so far, and since when it is too much."""

    Config = EnergyConfig
    config: EnergyConfig
    needs = ("work_J",)
    _energy = 0.0
    _moved = _seen = False

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._seen = True
        self._energy = observation.robots[self._robot].work_J
        self._moved = self._robot in observation.moved
        if self._energy <= self.config.max:
            self._at_s = observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far; a failure's time is the last one within the limit."""
        reason = "" if self._moved else f"{NOTHING}{self._robot} did not move"
        if not self._seen:
            reason = "the run made no step"
        if self._energy > self.config.max:
            reason = f"{self._robot} used {self._energy:.0f} J"
        return self._judged(reason, self._energy, self.config.max, "J", self._at_s)
