"""Checks on what a robot believes about its pose."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated

from twin.parameters import Metres, NotNegative, Positive, Seconds
from twin.scenario.checks.check import NOTHING, RobotCheckConfig, at_least_one
from twin.scenario.checks.signal_check import RobotSignalCheck
from twin.scenario.observation import Observation
from twin.scenario.temporal import Always, And, Finally, Formula, Margin, Predicate, Window


class LocalisationErrorConfig(RobotCheckConfig):
    """The estimated position in `map` stays near the true one."""

    rms: Annotated[Metres, Positive] | None = None
    """Largest root mean square of the error over the run [m]."""
    max: Annotated[Metres, Positive] | None = None
    """Largest error at any time [m]."""
    after: Annotated[Seconds, NotNegative] = 0.0
    """Time to converge from the initial pose, not judged [s]."""
    _has_a_limit = at_least_one("rms", "max")


class LocalisationError(RobotSignalCheck):
    """Looks at the error at any time, and at its root mean square at the end."""

    Config = LocalisationErrorConfig
    config: LocalisationErrorConfig

    def formula(self) -> Formula:
        """Return that neither is too large."""
        config, parts = self.config, list[Formula]()
        if config.rms is not None:
            parts.append(Finally(Predicate(f"localisation_rms({config.after!r})", "<=", config.rms)))
        if config.max is not None:
            small = Predicate("localisation_error", "<=", config.max)
            parts.append(Always(small, Window(round(config.after * 1e9))))
        return And(tuple(parts))

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return which one was too large."""
        kind = "rms" if "rms" in predicate.signal else "max"
        return f"{kind} error {margin.value:.3f} m at {margin.at_ns / 1e9:g} s"

    def silence(self, signals: Collection[str]) -> str:
        """Return why there was no error."""
        if self._believed:
            return f"{NOTHING}the run ended before {self.config.after:g} s"
        return f"{self.robot} published no estimate of its pose"

    def look(self, observation: Observation) -> None:
        """Judge one observation, after all that came before it."""
        super().look(observation)
        self._believed = self._believed or observation.robots[self.robot].estimate is not None

    _believed = False

    def nothing(self) -> str:
        """Return nothing: to know where one stands is something."""
        return ""


class OdometryDriftConfig(RobotCheckConfig):
    """Dead reckoning from start to end of the run is off by no more than this."""

    max: Annotated[Metres, Positive]
    """Largest distance of the odometry's end from the true one, seen from the start [m]."""


class OdometryDrift(RobotSignalCheck):
    """Looks at the drift at the end."""

    Config = OdometryDriftConfig
    config: OdometryDriftConfig

    def formula(self) -> Formula:
        """Return that it is small at the end."""
        return Finally(Predicate("odometry_drift", "<=", self.config.max))

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return how large it was."""
        return f"odometry ends {margin.value:.3f} m from the true position"

    def silence(self, signals: Collection[str]) -> str:
        """Return why there was none."""
        return f"{self.robot} published no odometry"
