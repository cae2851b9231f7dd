"""Check that a carried good does not slip in the gripper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.geometry import Array
from twin.parameters import Metres, Positive
from twin.scenario.checks.check import Check, CheckConfig, CheckResult
from twin.scenario.observation import CheckContext, Held, Observation

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
        return self._judged(self._reason, self._worst, self.config.max, "m", self._at_s)
