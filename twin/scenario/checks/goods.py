"""Checks on carried goods: where they were to be put, let go and at rest; and without slip in the gripper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.parameters import Metres, MetresPerSecond, NotNegative, Positive, Radians
from twin.scenario.checks.check import Check, CheckConfig, CheckResult
from twin.scenario.observation import CheckContext, Held, Observation, outside_distance


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
        tolerance, outside = self.config.tolerance, self._outside
        told = outside is not None and (outside <= tolerance) == (not self._reason)
        margin = tolerance - outside if outside is not None and told else None
        return self._judged(self._reason, outside, tolerance, "m", self._at_s, margin)


_LONGEST_GAP_NS = 500_000_000
"""A tote that nobody holds for longer was put down [ns]."""


class ToteSlipConfig(CheckConfig):
    """While a tote is held, it stays where it was in the gripper when the grasp closed."""

    max: Annotated[Metres, Positive]
    """Largest displacement of the tote's origin in the gripper's frame [m]."""
    tote: str | None = None
    """Name of the tote; absent: every tote that is carried."""


@dataclass
class _Grasp:
    robot: str
    start: Array
    """Origin of the tote in the gripper's frame when the grasp closed, shape (3,) [m]."""
    last_ns: int
    """When it was last seen."""
    looks: int = 0
    """How often it was seen; a single look is nothing to compare."""


class ToteSlip(Check):
    """Compares with the pose at the first tick of each grasp."""

    Config = ToteSlipConfig
    config: ToteSlipConfig
    _worst: float | None = None
    _at_s: float | None = None

    def __init__(self, name: str, config: ToteSlipConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._grasps: dict[str, _Grasp] = {}
        self._reason = "no tote was carried" if config.tote is None else f"{config.tote} was never carried"

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        if self._worst is None:
            self._at_s = observation.time_s
        for tote, held in observation.held.items():
            if self.config.tote not in (None, tote):
                continue
            grasp = self._grasp(tote, held, observation.time_ns)
            if grasp.looks < 2:
                continue
            slip = math.dist(held.T_gripper_good.xyz, grasp.start)
            if self._worst is None or slip > self._worst:
                self._worst, self._at_s = slip, observation.time_s
                slipped = f"{tote} slipped {slip * 1e3:.1f} mm in {held.robot}'s gripper"
                self._reason = "" if slip <= self.config.max else slipped

    def _grasp(self, tote: str, held: Held, time_ns: int) -> _Grasp:
        """Return the grasp that is going on; a contact that is lost for a moment does not end it."""
        grasp = self._grasps.get(tote)
        if grasp is None or grasp.robot != held.robot or time_ns - grasp.last_ns > _LONGEST_GAP_NS:
            grasp = _Grasp(held.robot, held.T_gripper_good.xyz.copy(), time_ns)
            self._grasps[tote] = grasp
        grasp.last_ns = time_ns
        grasp.looks += 1
        return grasp

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is the largest slip."""
        margin = None if self._worst is None else self.config.max - self._worst
        return self._judged(self._reason, self._worst, self.config.max, "m", self._at_s, margin)

    @property
    def decided(self) -> bool | None:
        """Whether it holds, whatever comes."""
        return False if self._worst is not None and self._worst > self.config.max else None
