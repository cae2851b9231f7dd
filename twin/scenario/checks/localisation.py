"""Checks on what a robot believes about its pose."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import model_validator

from twin.geometry import Pose2
from twin.parameters import Metres, NotNegative, Positive, Seconds
from twin.scenario.checks.check import NOTHING, BaseMotion, Check, CheckResult, RobotCheckConfig
from twin.scenario.observation import CheckContext, Observation


class LocalisationErrorConfig(RobotCheckConfig):
    """The estimated position in `map` stays near the true one."""

    rms: Annotated[Metres, Positive] | None = None
    """Largest root mean square of the error over the run [m]."""
    max: Annotated[Metres, Positive] | None = None
    """Largest error at any time [m]."""
    after: Annotated[Seconds, NotNegative] = 0.0
    """Time to converge from the initial pose, not judged [s]."""

    @model_validator(mode="after")
    def _has_a_limit(self) -> LocalisationErrorConfig:
        if self.rms is None and self.max is None:
            raise ValueError("must have at least one of the keys rms, max")
        return self


class LocalisationError(Check):
    """Sums squares and keeps the worst."""

    Config = LocalisationErrorConfig

    def __init__(self, name: str, config: LocalisationErrorConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._config, self._robot = config, context.robot(config.robot)
        self._squares = 0.0
        self._count = 0
        self._estimated = False
        self._worst = 0.0
        self._worst_at: float | None = None
        self._last: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._last = observation.time_s
        robot = observation.robots[self._robot]
        if robot.estimate is None:
            return
        self._estimated = True
        if observation.time_s < self._config.after:
            return
        error = math.hypot(robot.estimate.x - robot.pose.xyz[0], robot.estimate.y - robot.pose.xyz[1])
        error = error if math.isfinite(error) else math.inf
        self._squares += error * error
        self._count += 1
        if error >= self._worst:
            self._worst, self._worst_at = error, observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is the measure that comes off worst against its limit."""
        rms = math.sqrt(self._squares / self._count) if self._count else math.inf
        measures = [
            ("rms", rms, self._config.rms, self._last),
            ("max", self._worst, self._config.max, self._worst_at),
        ]
        limited = [
            (value / limit, kind, value, limit, at)
            for kind, value, limit, at in measures
            if limit is not None
        ]
        ratio, kind, value, limit, at = max(limited, key=lambda measure: measure[0])
        passed = bool(self._count) and ratio <= 1.0
        reason = (
            "" if passed else f"{kind} error {value:.3f} m, worst {self._worst:.3f} m at {self._worst_at} s"
        )
        if not self._count:
            reason = f"{self._robot} published no estimate of its pose"
            if self._estimated:
                reason = f"{NOTHING}the run ended before {self._config.after:g} s"
        return CheckResult(
            name=self.name,
            passed=passed,
            value=value if self._count else None,
            limit=limit,
            unit="m",
            at_s=at if self._count else self._last,
            reason=reason,
        )


class OdometryDriftConfig(RobotCheckConfig):
    """Dead reckoning from start to end of the run is off by no more than this."""

    max: Annotated[Metres, Positive]
    """Largest distance of the odometry's end from the true one, seen from the start [m]."""


class OdometryDrift(Check):
    """Keeps the first and the last pair of true and odometric pose."""

    Config = OdometryDriftConfig

    def __init__(self, name: str, config: OdometryDriftConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._config, self._robot = config, context.robot(config.robot)
        self._motion = BaseMotion()
        self._start: tuple[Pose2, Pose2] | None = None
        self._end: tuple[Pose2, Pose2] | None = None
        self._at_s: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._at_s = observation.time_s
        robot = observation.robots[self._robot]
        if robot.odometry is None:
            return
        self._motion.take(robot.pose)
        self._end = (robot.pose.to_pose2(), robot.odometry)
        self._start = self._start or self._end

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        drift: float | None = None
        reason = f"{self._robot} published no odometry"
        if self._start is not None and self._end is not None:
            true, odometric = (
                start.inverse() @ end for start, end in zip(self._start, self._end, strict=True)
            )
            drift = true.distance(odometric)
            reason = "" if self._motion.seen else f"{NOTHING}{self._robot} did not move"
            if not drift <= self._config.max:
                reason = f"odometry ends {drift:.3f} m from the true position"
        return CheckResult(
            name=self.name,
            passed=not reason,
            value=drift,
            limit=self._config.max,
            unit="m",
            at_s=self._at_s,
            reason=reason,
        )
