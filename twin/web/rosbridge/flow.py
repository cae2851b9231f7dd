"""One topic on its way to one client: how often, how much waits, and in which form."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count

from twin.errors import BridgeError
from twin.web.rosbridge.frames import COMPRESSIONS, Compression, Frame, Heard, in_fragments

_numbers = count(1)


@dataclass(frozen=True)
class Wanted:
    """What one `subscribe` asks for."""

    throttle_s: float = 0.0
    """Least time between two messages [s]."""
    queue_length: int = 0
    """Messages that wait for their time; 0: who comes too early is dropped."""
    fragment_size: int | None = None
    compression: Compression = "none"


class Flow:
    """What one client hears of one topic; several subscriptions count as one, as in rosbridge_library."""

    def __init__(self, send: Callable[[Frame], None], fault: Callable[[str], None]) -> None:
        self.wanted: dict[str | None, Wanted] = {}
        """By the id of the `subscribe`."""
        self.type: str | None = None
        """What the client expects."""
        self._send = send
        self._fault = fault
        self._last_s = float("-inf")
        self._queue: deque[Heard] = deque()
        self._told = ""

    @property
    def is_waiting(self) -> bool:
        """Whether something waits for its time."""
        return bool(self._queue)

    def offer(self, heard: Heard, now_s: float) -> None:
        """Send a message, or let it wait, or drop it."""
        throttle_s = min(wanted.throttle_s for wanted in self.wanted.values())
        most = min(wanted.queue_length for wanted in self.wanted.values())
        if throttle_s <= 0.0:
            self._pass(heard)
        elif not self._queue and now_s - self._last_s >= throttle_s:
            self._last_s = now_s
            self._pass(heard)
        elif most > 0:
            self._queue.append(heard)
            while len(self._queue) > most:
                self._queue.popleft()

    def update(self, now_s: float) -> None:
        """Send what has waited long enough."""
        throttle_s = min(wanted.throttle_s for wanted in self.wanted.values())
        if self._queue and now_s - self._last_s >= throttle_s:
            self._last_s = now_s
            self._pass(self._queue.popleft())

    def forget(self) -> None:
        """Let nothing wait: what it is of is over."""
        self._queue.clear()

    @property
    def compression(self) -> Compression:
        """The strongest that is asked for."""
        return max((w.compression for w in self.wanted.values()), key=COMPRESSIONS.index)

    def _pass(self, heard: Heard) -> None:
        try:
            if self.type not in (None, heard.sample.type):
                raise BridgeError(f"{heard.sample.topic} has the type {heard.sample.type}, not {self.type}")
            frame = heard.frame(self.compression)
        except BridgeError as error:
            if str(error) != self._told:
                self._told = str(error)
                self._fault(self._told)
            return
        sizes = [w.fragment_size for w in self.wanted.values() if w.fragment_size is not None]
        size = min(sizes, default=None)
        for piece in in_fragments(frame, size, next(_numbers)) if size else (frame,):
            self._send(piece)


class Watch(Flow):
    """A topic for who is no client of the protocol: each message as it came."""

    def __init__(self, take: Callable[[Heard], None], forget: Callable[[], None] = lambda: None) -> None:
        super().__init__(lambda frame: None, lambda told: None)
        self.wanted[None] = Wanted()
        self._take, self._forget = take, forget

    def forget(self) -> None:
        """Tell that what was heard is over."""
        self._forget()

    def _pass(self, heard: Heard) -> None:
        self._take(heard)
