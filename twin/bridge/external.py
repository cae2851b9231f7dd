"""What comes from other processes: queued by Zenoh's threads, admitted at tick borders in a fixed order."""

from __future__ import annotations

import logging
import threading
from collections import Counter, deque
from typing import Any, NamedTuple, Protocol

from twin.bridge.keys import Attachment

_log = logging.getLogger("twin.bus")


class Receiver(Protocol):
    """An endpoint that takes what was queued for it."""

    name: str
    """Of the topic or service."""

    def enqueue(self, data: Any, external: bool) -> None:
        """Put into the node's inbox."""


class Arrival(NamedTuple):
    """A sample, request or reply from outside."""

    source: Attachment
    receiver: Receiver
    data: Any


class ExternalQueue:
    """A bounded queue that threads fill and the bus's thread empties; when full it drops the oldest."""

    def __init__(self, depth: int) -> None:
        self.refused: Counter[str] = Counter()
        """What was not delivered, by reason: 'overflow', 'attachment', 'payload', 'type hash'."""
        self._arrivals: deque[Arrival] = deque()
        self._depth = depth
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._to_report: list[str] = []
        self._reported: set[tuple[str, str]] = set()

    @property
    def waiting(self) -> int:
        """How much the next `drain` returns."""
        return len(self._arrivals)

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive, at most so long [s] of wall time; return whether something did."""
        return self._arrived.wait(timeout_s)

    def wake(self) -> None:
        """End a `wait` although nothing was queued; called in any thread."""
        self._arrived.set()

    def push(self, arrival: Arrival) -> None:
        """Queue; called in any thread."""
        with self._lock:
            self._arrivals.append(arrival)
            if len(self._arrivals) > self._depth:
                dropped = self._arrivals.popleft()
                self._refuse(
                    "overflow", dropped.receiver.name, f"more than {self._depth} samples in one tick"
                )
        self._arrived.set()

    def refuse(self, reason: str, name: str, detail: str) -> None:
        """Count something that cannot be delivered; the first of its kind is logged. Called in any thread."""
        with self._lock:
            self._refuse(reason, name, detail)

    def drain(self) -> list[Arrival]:
        """Return what has arrived, sorted by (topic, source, sequence), and log what was refused."""
        self._arrived.clear()
        with self._lock:
            arrivals, self._arrivals = self._arrivals, deque()
            reports, self._to_report = self._to_report, []
        for report in reports:
            _log.warning(report)
        return sorted(arrivals, key=lambda a: (a.receiver.name, a.source.gid, a.source.sequence))

    def _refuse(self, reason: str, name: str, detail: str) -> None:
        self.refused[reason] += 1
        if (reason, name) not in self._reported:
            self._reported.add((reason, name))
            self._to_report.append(
                f"{name}: a message from outside was dropped ({reason}: {detail}); reported once"
            )
