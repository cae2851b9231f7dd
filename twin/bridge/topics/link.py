"""What lies between publishers and those who hear them: messages may get lost, or come late or twice."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from itertools import count
from typing import NamedTuple

from twin.bridge.clock import Clock


class Carried(NamedTuple):
    """A message on its way."""

    topic: str
    """Absolute name."""
    sender: str
    """Full name of the node, or empty if it is in another process."""
    sequence: int
    """The publisher's count, from 1."""
    is_latched: bool
    is_heard: bool
    """Whether somebody listens."""


_SENT_AGAIN_NS = 200_000_000
"""TCP's shortest time-out for sending again, on Linux."""

Stage = Callable[[Carried], Sequence[int]]
"""Returns by how much each copy that arrives is late [ns]: () if none does, (0,) for a message as it is."""


class Link:
    """Carries the messages of a bus through stages, one after the other.

    A message that is lost was not published, for taps (digest, bag, recording) as for nodes; one that is late
    is published when it arrives, whenever its header says. So a bag holds what a listener had heard.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._count = count()
        self._late: list[tuple[int, int, Callable[[], None]]] = []
        self.stages: list[Stage] = []

    def carry(self, message: Carried, deliver: Callable[[], None]) -> None:
        """Deliver a message as often, and as late, as the stages say."""
        delays = [0]
        for stage in self.stages:
            delays = [delay + more for delay in delays for more in stage(message)]
        for delay in delays:
            self._deliver(delay, deliver)

    def _deliver(self, delay: int, deliver: Callable[[], None]) -> None:
        if delay > 0:
            heapq.heappush(self._late, (self._clock.now_ns + delay, next(self._count), deliver))
        else:
            deliver()

    def carry_call(self, message: Carried, deliver: Callable[[], None]) -> None:
        """Deliver a request or a response once: what is lost is sent again, doubles are dropped."""
        late = sum(min(stage(message), default=_SENT_AGAIN_NS) for stage in self.stages)
        self._deliver(late, deliver)

    def release(self) -> None:
        """Deliver what arrives by now; to be called before nodes run."""
        while self._late and self._late[0][0] <= self._clock.now_ns:
            heapq.heappop(self._late)[2]()
