"""Whether a robot that can only be seen does what it is told: its motion is the acknowledgement."""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.live.mirror.label import NOBODY


@dataclass(frozen=True, kw_only=True)
class ObedienceConfig:
    """What counts as obeying."""

    patience_s: float = 1.0
    """A robot begins to move, or is at rest, so long after it was told to [s]."""
    share: float = 0.3
    """It moves as told if by so much of it, at least."""
    still: float = 0.05
    """It rests if it is no faster [m/s], [rad/s]; slower commands tell nothing."""


class Obedience:
    """Compares velocities commanded from here with those that odometry tells; times are of one clock [ns]."""

    def __init__(self, config: ObedienceConfig | None = None) -> None:
        """Know nothing yet."""
        self.config = config or ObedienceConfig()
        self.obeyed: bool | None = None
        """None: nothing has been commanded."""
        self.text = NOBODY
        """In words."""
        self.delay_s: float | None = None
        """From the latest command to move, after rest, to the first motion that was seen [s]."""
        self._told: tuple[float, float] = (0.0, 0.0)
        self._since_ns: int | None = None
        """When what is commanded began to differ from rest, or to be rest."""

    def forget(self) -> None:
        """Let the next command be the first: times are of another clock from now on."""
        self._since_ns, self._told = None, (0.0, 0.0)

    def command(self, time_ns: int, linear: float, angular: float) -> None:
        """Take a command [m/s, rad/s]; one that is not finite is none."""
        if not math.isfinite(linear + angular):
            return
        moves = self._moves(linear, angular)
        if self._since_ns is None or moves != self._moves(*self._told):
            self._since_ns = time_ns
            self.delay_s = None if moves else self.delay_s
        self._told = linear, angular

    def motion(self, time_ns: int, linear: float, angular: float) -> None:
        """Take what odometry tells [m/s, rad/s]; what is not finite tells nothing."""
        if self._since_ns is None or not math.isfinite(linear + angular):
            return
        config, told = self.config, self._told
        waited_s = (time_ns - self._since_ns) * 1e-9
        if self._moves(*told):
            along = (told[0] * linear + told[1] * angular) / (told[0] ** 2 + told[1] ** 2)
            as_told = along >= config.share
            if as_told and self.delay_s is None:
                self.delay_s = waited_s
        else:
            as_told = not self._moves(linear, angular)
        if as_told:
            self.obeyed, self.text = True, "obeys"
            if self._moves(*told):
                self._since_ns = time_ns
        elif waited_s > config.patience_s:
            self.obeyed = False
            what = "does not move" if self._moves(*told) else "does not stop"
            self.text = f"the robot was commanded from here, but {what} for {waited_s:.1f} s"
        elif self.obeyed is None:
            self.text = "what was commanded from here has not been obeyed yet"

    def _moves(self, linear: float, angular: float) -> bool:
        return max(abs(linear), abs(angular)) > self.config.still
