"""Turning in place to a heading: what regulated pure pursuit and the rotation shim share."""

from __future__ import annotations

import math


def turn_rate(angle: float, w_now: float, dt: float, *, max_rate: float, acceleration: float) -> float:
    """Return w [rad/s] for turning by `angle` [rad]: reachable from `w_now`, and able to stop in time.

    Args:
        angle: Still to turn, signed.
        w_now: The present rate [rad/s].
        dt: Control period [s].
        max_rate: [rad/s]
        acceleration: [rad/s²]
    """
    change = acceleration * dt
    w = min(max(math.copysign(max_rate, angle), w_now - change), w_now + change)
    stoppable = min(math.sqrt(2.0 * acceleration * abs(angle)), abs(angle) / dt)
    return math.copysign(stoppable, angle) if abs(w) > stoppable else w
