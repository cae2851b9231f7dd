"""Commands from here that the link still carries: the virtual robot gets them when the physical one does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

M = TypeVar("M")


class Underway(Generic[M]):
    """Hands over what is sent once it will have arrived at the robot.

    By a clock that was estimated as being in the middle of what questions and answers allow, a message takes
    half the round trip to the robot, however the trip is split: see `ClockOffset`.
    """

    def __init__(self, arrived: Callable[[M], None]) -> None:
        """Carry nothing yet; `arrived` is called with each message, in the order they were sent."""
        self.takes_s = 0.0
        """How long the link takes to the robot [s]."""
        self._arrived = arrived
        self._sent: deque[tuple[int, M]] = deque()

    def send(self, time_ns: int, message: M) -> None:
        """Take a message at a time of the robot's clock [ns]; one that takes no time has arrived."""
        self._sent.append((time_ns + round(self.takes_s * 1e9), message))
        self.update(time_ns)

    def update(self, time_ns: int) -> None:
        """Hand over what has arrived at a time of the robot's clock [ns]; nothing overtakes."""
        while self._sent and self._sent[0][0] <= time_ns:
            self._arrived(self._sent.popleft()[1])

    def forget(self) -> None:
        """Carry nothing any more: times are of another clock from now on."""
        self._sent.clear()
