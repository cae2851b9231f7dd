"""What comes from other processes: queued by Zenoh's threads, admitted at tick borders in a fixed order."""

from __future__ import annotations

import logging
import threading
from collections import Counter, deque
from itertools import chain
from typing import Any, NamedTuple, Protocol

from twin.bridge.wire.keys import Attachment

_log = logging.getLogger("twin.bus")
_MOST_REPORTS = 1000
"""Others may choose the names, and with them how much is kept."""


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
    size: int = 0
    """Of the payload [bytes]."""


class ExternalQueue:
    """A queue that threads fill and the bus's thread empties, bounded in samples and bytes.

    When it is full, the oldest gives way: that of the receiver that is being flooded, not another one's.
    """

    def __init__(self, depth: int, max_bytes: int = 256 * 2**20) -> None:
        self.refused: Counter[str] = Counter()
        """What was not delivered, by reason; see `Bus.refused`."""
        self.trailing = 0
        """Messages that were delivered without the bytes that followed them."""
        self._depth, self._max_bytes = depth, max_bytes
        self._waiting: dict[int, deque[Arrival]] = {}
        """Arrivals by receiver."""
        self._count = self._bytes = 0
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._to_report: list[str] = []
        self._reported: set[tuple[str, str]] = set()

    @property
    def waiting(self) -> int:
        """How much the next `drain` returns."""
        return self._count

    def wait(self, timeout_s: float) -> bool:
        """Wait for something to arrive, at most so long [s] of wall time; return whether something did."""
        return self._arrived.wait(timeout_s)

    def wake(self) -> None:
        """End a `wait` although nothing was queued; called in any thread."""
        self._arrived.set()

    def push(self, arrival: Arrival) -> None:
        """Queue; called in any thread."""
        with self._lock:
            own = self._waiting.setdefault(id(arrival.receiver), deque())
            own.append(arrival)
            self._count += 1
            self._bytes += arrival.size
            while self._count > self._depth or self._bytes > self._max_bytes:
                self._drop_oldest(own)
        self._arrived.set()

    def forked(self) -> None:
        """Be empty, in a fork: a thread that is not there may have been about to put something in."""
        self._lock, self._arrived = threading.Lock(), threading.Event()
        self._waiting, self._to_report = {}, []
        self._count = self._bytes = 0

    def refuse(self, reason: str, name: str, detail: str) -> None:
        """Count something that cannot be delivered; the first of its kind is logged. Called in any thread."""
        with self._lock:
            self._refuse(reason, name, detail)

    def ignore_after(self, name: str, left: int) -> None:
        """Count a message that so many bytes follow; the first is logged. Called in any thread."""
        with self._lock:
            self.trailing += 1
            self._report("trailing", name, f"{left} bytes after a message are ignored, as in ROS 2")

    def drain(self) -> list[Arrival]:
        """Return what has arrived, sorted by (topic, source, sequence), and log what was refused."""
        if not self._arrived.is_set() and not self._to_report:  # as in every tick of a run on its own
            return []
        self._arrived.clear()
        with self._lock:
            waiting, self._waiting = self._waiting, {}
            self._count = self._bytes = 0
        self.report()
        arrivals = chain.from_iterable(waiting.values())
        return sorted(arrivals, key=lambda a: (a.receiver.name, a.source.gid, a.source.sequence))

    def report(self) -> None:
        """Log what was refused since the last time: each reason once per name."""
        with self._lock:
            reports, self._to_report = self._to_report, []
        for report in reports:
            _log.warning(report)

    def _drop_oldest(self, own: deque[Arrival]) -> None:
        """Drop the oldest of a receiver that has its share or more, else of the one that has the most."""
        limit = f"{self._depth} samples" if self._count > self._depth else f"{self._max_bytes >> 20} MiB"
        fair = len(own) * len(self._waiting) >= self._count
        queue = own if fair else max(self._waiting.values(), key=len)
        dropped = queue.popleft()
        self._count -= 1
        self._bytes -= dropped.size
        self._refuse("overflow", dropped.receiver.name, f"more than {limit} in one tick")

    def _refuse(self, reason: str, name: str, detail: str) -> None:
        self.refused[reason] += 1
        self._report(reason, name, f"a message from outside was dropped ({reason}: {detail})")

    def _report(self, reason: str, name: str, sentence: str) -> None:
        if len(self._reported) < _MOST_REPORTS and (reason, name) not in self._reported:
            self._reported.add((reason, name))
            self._to_report.append(f"{_clipped(name)}: {sentence}; reported once")


def _clipped(name: str) -> str:
    return name if len(name) <= 200 else f"{name[:200]}…"
