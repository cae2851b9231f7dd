"""How often somebody may do something."""

from __future__ import annotations


class Bucket:
    """So many things a second, over some seconds: time fills it, what is done empties it."""

    def __init__(self, per_s: float) -> None:
        self._rate = per_s
        self._left = self._burst = 2.0 * per_s
        self._last_s = 0.0

    def may_go(self, now_s: float) -> bool:
        """Take note of one thing; return whether it is within the rate."""
        self._left = min(self._burst, self._left + (now_s - self._last_s) * self._rate) - 1.0
        self._last_s = now_s
        if self._left < 0.0:
            self._left = 0.0
            return False
        return True
