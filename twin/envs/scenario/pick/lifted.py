"""Whether a tote is really held above where it stood."""

from __future__ import annotations

from typing import Annotated

from twin.parameters import Metres, Positive
from twin.scenario.checks.check import Check, CheckConfig, CheckResult
from twin.scenario.observation import Observation


class LiftedConfig(CheckConfig):
    """A tote ends in a gripper, above where it stood."""

    tote: str
    """Name of the tote."""
    by: Annotated[Metres, Positive] = 0.04
    """How far it has to be lifted [m]."""


class Lifted(Check):
    """Judges each observation; the last one counts."""

    Config = LiftedConfig
    config: LiftedConfig
    _start: float | None = None
    _by: float | None = None
    _held = False
    _at_s: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        tote = self.config.tote
        pose, self._held = observation.goods.get(tote), tote in observation.held
        if pose is not None:
            z = float(pose.xyz[2])
            self._start = z if self._start is None else self._start
            self._by, self._at_s = z - self._start, observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is how far it was lifted."""
        tote, by, limit = self.config.tote, self._by or 0.0, self.config.by
        reason = "" if self._held else f"nobody holds {tote}"
        if not reason and by < limit:
            reason = f"{tote} is {by * 1e3:.0f} mm above where it stood"
        return self._judged(reason, self._by, limit, "m", self._at_s)
