"""Checks on what a robot believes about its pose."""

from __future__ import annotations

import math
from typing import Annotated

from twin.geometry import Pose2
from twin.parameters import Metres, NotNegative, Positive, Seconds
from twin.scenario.checks.check import NOTHING, CheckResult, RobotCheck, RobotCheckConfig, at_least_one
from twin.scenario.observation import Observation


class LocalisationErrorConfig(RobotCheckConfig):
    """The estimated position in `map` stays near the true one."""

    rms: Annotated[Metres, Positive] | None = None
    """Largest root mean square of the error over the run [m]."""
    max: Annotated[Metres, Positive] | None = None
    """Largest error at any time [m]."""
    after: Annotated[Seconds, NotNegative] = 0.0
    """Time to converge from the initial pose, not judged [s]."""
    _has_a_limit = at_least_one("rms", "max")


class LocalisationError(RobotCheck):
    """Sums squares and keeps the worst."""

    Config = LocalisationErrorConfig
    config: LocalisationErrorConfig
    _squares = _worst = 0.0
    _count = 0
    _estimated = False
    _worst_at: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._at_s = observation.time_s
        robot = observation.robots[self._robot]
        if robot.estimate is None:
            return
        self._estimated = True
        if observation.time_s < self.config.after:
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
            (value / limit, kind, value, limit, at)
            for kind, value, limit, at in (
                ("rms", rms, self.config.rms, self._at_s),
                ("max", self._worst, self.config.max, self._worst_at),
            )
            if limit is not None
        ]
        ratio, kind, value, limit, at = max(measures, key=lambda measure: measure[0])
        if not self._count:
            reason = f"{self._robot} published no estimate of its pose"
            if self._estimated:
                reason = f"{NOTHING}the run ended before {self.config.after:g} s"
            return self._judged(reason, None, limit, "m", self._at_s)
        reason = f"{kind} error {value:.3f} m, worst {self._worst:.3f} m at {self._worst_at} s"
        return self._judged("" if ratio <= 1.0 else reason, value, limit, "m", at)


class OdometryDriftConfig(RobotCheckConfig):
    """Dead reckoning from start to end of the run is off by no more than this."""

    max: Annotated[Metres, Positive]
    """Largest distance of the odometry's end from the true one, seen from the start [m]."""


class OdometryDrift(RobotCheck):
    """Keeps the first and the last pair of true and odometric pose."""

    Config = OdometryDriftConfig
    config: OdometryDriftConfig
    _start: tuple[Pose2, Pose2] | None = None
    _end: tuple[Pose2, Pose2] | None = None

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
            reason = self._stood
            if not drift <= self.config.max:
                reason = f"odometry ends {drift:.3f} m from the true position"
        return self._judged(reason, drift, self.config.max, "m", self._at_s)
