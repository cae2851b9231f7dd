"""The state of an emergency stop: latched, whoever asks how often, until a release."""

from __future__ import annotations

from collections import deque

RELEASE_WITHIN_S = 2.0
"""A release may come so long after the status that its sender saw [s]."""


class EmergencyStop:
    """Who holds a robot stopped; every `now_ns` is by one clock that is never set [ns]."""

    def __init__(self, stopped_by: str | None = None, release_within: float = RELEASE_WITHIN_S) -> None:
        """Begin stopped by somebody, or free to move.

        Args:
            stopped_by: Who stops from the start; None: nobody.
            release_within: A release may come so long after the status that its sender saw [s].
        """
        self.stopped_by = stopped_by
        """Who holds the robot stopped; None: it may move."""
        self.stops = 0
        """How often it was stopped while it could move."""
        self.stopped_ns = 0
        """When it was last heard that it is to stop."""
        self._release_within_ns = round(release_within * 1e9)
        self._told: deque[tuple[int, int]] = deque()

    def stop(self, by: str, now_ns: int) -> None:
        """Stop the robot until a release; what is heard again is as good as new."""
        if self.stopped_by is None:
            self.stops += 1
        self.stopped_by = by or "somebody"
        self.stopped_ns = now_ns

    def told(self, stamp_ns: int, now_ns: int) -> None:
        """Note that a status with this stamp tells what is the case now."""
        self._told.append((stamp_ns, now_ns))
        while now_ns - self._told[0][1] > self._release_within_ns:
            self._told.popleft()

    def release(self, seen_ns: int | None, now_ns: int) -> bool:
        """Let the robot move again, by commands that come from now on; return whether it may.

        Args:
            seen_ns: Stamp of the status by which the one who releases knows of the stop: a release that was
                under way for too long, or before another stop, releases nothing. None: whatever it knows.
            now_ns: When it arrived.
        """
        if self.stopped_by is None:
            return True
        least_ns = max(self.stopped_ns, now_ns - self._release_within_ns)
        if seen_ns is not None and not any(
            stamp_ns == seen_ns and told_ns >= least_ns for stamp_ns, told_ns in self._told
        ):
            return False
        self.stopped_by = None
        return True
