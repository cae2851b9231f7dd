"""Checks on sums over a run: distance driven, energy used."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from twin.parameters import Joules, Metres, NotNegative, Positive
from twin.scenario.checks.check import RobotCheckConfig
from twin.scenario.checks.signal_check import RobotSignalCheck
from twin.scenario.observation import Observation
from twin.scenario.temporal import Always, And, Finally, Formula, Margin, Predicate


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


class DrivenDistance(RobotSignalCheck):
    """Looks at the length at the end."""

    Config = DrivenDistanceConfig
    config: DrivenDistanceConfig

    def formula(self) -> Formula:
        """Return both bounds, at the end."""
        low, high = self.config.min, self.config.max
        parts = [] if low is None else [Predicate("driven_distance", ">=", low)]
        parts += [] if high is None else [Predicate("driven_distance", "<=", high)]
        return Finally(And(tuple(parts)))

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return which bound was missed."""
        side = "less" if predicate.relation == ">=" else "more"
        return f"{self.robot} drove {margin.value:.2f} m, {side} than allowed"

    def nothing(self) -> str:
        """Return that it stood, unless it may."""
        return super().nothing() if self.config.min is None else ""


class EnergyConfig(RobotCheckConfig):
    """The actuators do no more mechanical work than this.

    It is the force on each joint times the joint's true velocity, summed over the physics steps in which
    the product is positive: what a joint takes up while it brakes is lost.
    """

    max: Annotated[Joules, Positive]
    """Largest work [J]."""


class Energy(RobotSignalCheck):
    """Looks at the work done so far."""

    Config = EnergyConfig
    config: EnergyConfig
    _moved = False

    def formula(self) -> Formula:
        """Return that it never is too much."""
        return Always(Predicate("energy", "<=", self.config.max))

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return how much it was."""
        return f"{self.robot} used {margin.value:.0f} J"

    def look(self, observation: Observation) -> None:
        """Judge one observation, after all that came before it."""
        super().look(observation)
        self._moved = self.robot in observation.moved

    def nothing(self) -> str:
        """Return that nothing of it moved."""
        return "" if self._moved else f"{self.robot} did not move"
