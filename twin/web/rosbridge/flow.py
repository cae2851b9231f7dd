"""One topic on its way to one client: how often, how much waits, and in which form."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count

from twin.errors import BridgeError
from twin.web.rosbridge.frames import COMPRESSIONS, Compression, Frame, Heard, Send, in_fragments

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

    def __init__(self, topic: str, send: Send, fault: Callable[[str], None]) -> None:
        self.type: str | None = None
        """What the client expects."""
        self.late: dict[Flow, None] = {}
        """Where it is while something waits for its time, together with others."""
        self._wanted: dict[str | None, Wanted] = {}
        """By the id of the `subscribe`."""
        self._in_all = Wanted()
        """What all of them come to: this is looked at for each message."""
        self._topic, self._send = topic, send
        self._fault = fault
        self._last_s = float("-inf")
        self._queue: deque[Heard] = deque()
        self._told = ""

    @property
    def at_once(self) -> tuple[str | None, Compression] | None:
        """Type and compression, if each message goes out as it comes and whole; who has the same is alike."""
        wanted = self._in_all
        if not self._wanted or wanted.throttle_s > 0.0 or wanted.fragment_size is not None:
            return None
        return self.type, wanted.compression

    def want(self, key: str | None, wanted: Wanted) -> None:
        """Add what a `subscribe` of an id asks for, or change it."""
        self._wanted[key] = wanted
        self._sum_up()

    def unwant(self, key: str | None) -> bool:
        """Forget what was asked for with an id, all if there is none; return whether nothing is left."""
        if key is None:
            self._wanted.clear()
        self._wanted.pop(key, None)
        if self._wanted:
            self._sum_up()
        return not self._wanted

    def _sum_up(self) -> None:
        wanted = self._wanted.values()
        sizes = [each.fragment_size for each in wanted if each.fragment_size is not None]
        self._in_all = Wanted(
            throttle_s=min(each.throttle_s for each in wanted),
            queue_length=min(each.queue_length for each in wanted),
            fragment_size=min(sizes, default=None),
            compression=max((each.compression for each in wanted), key=COMPRESSIONS.index),
        )

    def offer(self, heard: Heard, now_s: float) -> None:
        """Send a message, or let it wait, or drop it."""
        throttle_s = self._in_all.throttle_s
        if throttle_s <= 0.0:
            self._pass(heard)
        elif not self._queue and now_s - self._last_s >= throttle_s:
            self._last_s = now_s
            self._pass(heard)
        elif self._in_all.queue_length > 0:
            self._queue.append(heard)
            self.late[self] = None
            while len(self._queue) > self._in_all.queue_length:
                self._queue.popleft()

    def update(self, now_s: float) -> None:
        """Send what has waited long enough."""
        if self._queue and now_s - self._last_s >= self._in_all.throttle_s:
            self._last_s = now_s
            self._pass(self._queue.popleft())
        if not self._queue:
            self.late.pop(self, None)

    def forget(self) -> None:
        """Let nothing wait: what it is of is over."""
        self._queue.clear()
        self.late.pop(self, None)

    def frame_of(self, heard: Heard) -> Frame:
        """Return what the client gets of a message.

        Raises:
            BridgeError: it has another type than the client expects, or no frame can be made of it.
        """
        if self.type is not None and self.type != heard.sample.type:
            raise BridgeError(f"{heard.sample.topic} has the type {heard.sample.type}, not {self.type}")
        return heard.frame(self._in_all.compression)

    def tell(self, fault: str) -> None:
        """Tell the client why it hears nothing, once."""
        if fault != self._told:
            self._told = fault
            self._fault(fault)

    def _pass(self, heard: Heard) -> None:
        try:
            frame = self.frame_of(heard)
        except BridgeError as error:
            self.tell(str(error))
            return
        size = self._in_all.fragment_size
        if size is None:
            self._send(frame, self._topic)
            return
        for piece in in_fragments(frame, size, next(_numbers)):
            self._send(piece, self._topic)


class Crowd:
    """Flows of a topic that are `at_once` in the same way: a frame goes to all of them in one call."""

    def __init__(self, topic: str, flows: Sequence[Flow], send: Send) -> None:
        """Take flows, at least one, and what sends to all of their clients."""
        self._topic, self._flows, self._send = topic, flows, send

    def offer(self, heard: Heard) -> None:
        """Send a message."""
        try:
            frame = self._flows[0].frame_of(heard)
        except BridgeError as error:
            for flow in self._flows:
                flow.tell(str(error))
        else:
            self._send(frame, self._topic)


class Watch(Flow):
    """A topic for who is no client of the protocol: each message as it came."""

    def __init__(self, take: Callable[[Heard], None], forget: Callable[[], None] = lambda: None) -> None:
        super().__init__("", lambda frame, topic: None, lambda told: None)
        self._take, self._forget = take, forget

    def forget(self) -> None:
        """Tell that what was heard is over."""
        self._forget()

    def _pass(self, heard: Heard) -> None:
        self._take(heard)
