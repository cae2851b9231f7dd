"""Check that a good lies where it was to be put, let go and at rest."""

from __future__ import annotations

import math
from typing import Annotated

from twin.geometry import Pose2, Pose3, matrix_from_quat_wxyz
from twin.parameters import Metres, MetresPerSecond, NotNegative, Positive, Radians
from twin.scenario.checks.check import Check, CheckConfig, CheckResult
from twin.scenario.observation import CheckContext, Observation, Zone


class DeliveredConfig(CheckConfig):
    """A tote ends in a zone: centre inside, on its surface, upright, released, at rest."""

    tote: str
    """Name of the tote."""
    zone: str
    """Name of the arena's zone."""
    upright: Annotated[Radians, Positive] = math.radians(5.0)
    """Largest tilt against the vertical [rad]."""
    tolerance: Annotated[Metres, NotNegative] = 0.0
    """How far the centre of the footprint may lie outside of the zone's rectangle [m]."""
    height_tolerance: Annotated[Metres, Positive] = 0.02
    """How far the underside may be above or below the zone's surface [m]."""
    rest_speed: Annotated[MetresPerSecond, Positive] = 0.01
    """Speed below which it is at rest [m/s]."""


class Delivered(Check):
    """Judges each tick; the last one counts, and its time is the start of the last unbroken success."""

    Config = DeliveredConfig
    config: DeliveredConfig
    _previous: tuple[float, Pose3] | None = None
    _outside: float | None = None
    _at_s: float | None = None

    def __init__(self, name: str, config: DeliveredConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._zone, self._bottom = context.zone(config.zone), context.good_bottom(config.tote)
        self._reason = f"{config.tote} was never seen"

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        tote, had_passed = self.config.tote, not self._reason
        pose = observation.goods.get(tote)
        if pose is None:
            return
        self._outside = outside_distance(self._zone, pose)
        held = observation.held.get(tote)
        if held is not None:
            self._reason = f"{tote} is still held by {held.robot}"
        else:
            self._reason = self._fault(observation.time_s, pose)
        if self._reason or not had_passed:
            self._at_s = observation.time_s
        self._previous = (observation.time_s, pose)

    def _fault(self, time_s: float, pose: Pose3) -> str:
        config, zone = self.config, self._zone
        if self._outside is not None and self._outside > config.tolerance:
            return f"{config.tote} is {self._outside:.3f} m outside of {config.zone}"
        above = float(pose.xyz[2]) - self._bottom - zone.height
        tilt = math.acos(max(-1.0, min(1.0, float(matrix_from_quat_wxyz(pose.quat_wxyz)[2, 2]))))
        if tilt > config.upright:
            limit = math.degrees(config.upright)
            return f"{config.tote} is tilted by {math.degrees(tilt):.1f} deg (limit {limit:.1f} deg)"
        if abs(above) > config.height_tolerance:
            side = "above" if above > 0.0 else "below"
            return f"{config.tote} is {abs(above):.3f} m {side} the surface of {config.zone}"
        speed = self._speed(time_s, pose)
        if speed > config.rest_speed:
            return f"{config.tote} still moves at {speed:.3f} m/s"
        return ""

    def _speed(self, time_s: float, pose: Pose3) -> float:
        if self._previous is None or time_s <= self._previous[0]:
            return 0.0
        return math.dist(pose.xyz, self._previous[1].xyz) / (time_s - self._previous[0])

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is the distance outside of the zone."""
        return self._judged(self._reason, self._outside, self.config.tolerance, "m", self._at_s)


def outside_distance(zone: Zone, pose: Pose3) -> float:
    """Return how far the origin of `pose` is outside of the zone's rectangle [m]; 0 inside."""
    x, y, _ = pose.xyz.tolist()
    local = zone.T_zone_world @ Pose2(x, y, 0.0)
    dx = max(0.0, abs(local.x) - zone.size[0] / 2.0)
    dy = max(0.0, abs(local.y) - zone.size[1] / 2.0)
    return math.hypot(dx, dy)
