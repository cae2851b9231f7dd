"""What a robot has done so far, of what it has to do so that it can be calibrated."""

from __future__ import annotations

import math

_LONGEST_STEP_S = 0.5
"""What happened between messages that are farther apart is not known."""
_DISTANCE, _ANGLE = 2.0, 3.0
"""Enough, [m] and, to each side, [rad]."""
_CHANGES, _CHANGE = 6, 0.1
"""So many changes of speed by this [m/s] at least are enough."""


class Excitation:
    """Adds up the motion that odometry tells."""

    def __init__(self) -> None:
        self.distance = 0.0
        """Forwards and backwards [m]."""
        self.left = self.right = 0.0
        """Turned to each side [rad]."""
        self.changes = 0
        """Of the speed."""
        self._time_s: float | None = None
        self._speed = 0.0

    def put(self, time_s: float, speed: float, turn: float) -> None:
        """Take a speed [m/s] and a turn rate, positive to the left [rad/s], at a time."""
        if not (math.isfinite(speed) and math.isfinite(turn)):
            return
        step = 0.0 if self._time_s is None else time_s - self._time_s
        self._time_s = time_s
        if 0.0 < step < _LONGEST_STEP_S:
            self.distance += abs(speed) * step
            self.left += max(0.0, turn) * step
            self.right += max(0.0, -turn) * step
        if abs(speed - self._speed) >= _CHANGE:
            self._speed = speed
            self.changes += 1

    @property
    def lacking(self) -> tuple[str, ...]:
        """What it has not done enough, as participles."""
        done = {
            "driven": self.distance >= _DISTANCE,
            "turned left": self.left >= _ANGLE,
            "turned right": self.right >= _ANGLE,
            "changed its speed": self.changes >= _CHANGES,
        }
        return tuple(what for what, is_enough in done.items() if not is_enough)
