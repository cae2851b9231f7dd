"""Physical robots as a bag has them: the same messages at the same ticks, every time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.bags.definitions import complete
from twin.bridge.bags.metadata import BagMessage
from twin.bridge.bags.offered_qos import publisher_qos
from twin.bridge.bags.reader import BagReader
from twin.bridge.cdr.codec import codec
from twin.bridge.topics import Publisher
from twin.errors import BridgeError, RecordingError
from twin.live.mirror.source import ClockChange, ClockReading, Source

if TYPE_CHECKING:
    from twin.live.mirror.followed_clock import FollowedClock
    from twin.runtime.open_run import OpenRun

_OWN = "/twin/"
_NOT_PLAYED = ("/clock", "/rosout", "/parameter_events", "/diagnostics")
_WINDOW_NS = 10_000_000_000
_LARGEST_STEP_NS = 500_000_000


class BagSource(Source):
    """A bag's messages by the time at which they were received.

    The robots' clock is that of the times of publishing. It is ahead of the recorder's by what the fastest
    message of the last seconds tells; a mirror's own messages, if the bag has some, tell it best.
    """

    def __init__(self, path: Path) -> None:
        """Open a bag.

        Raises:
            RecordingError: It cannot be read.
        """
        self._bag = BagReader(path)
        self._has_own = any(name.startswith(_OWN) for name in self._bag.topics)
        played = [name for name in self._bag.topics if not name.startswith(_OWN) and name not in _NOT_PLAYED]
        if not played:
            raise RecordingError(f"{path}: has no message of a robot")
        self._played = frozenset(played)
        self._messages = self._bag.messages()
        self._next: BagMessage | None = next(self._messages, None)
        self._start_ns = 0 if self._next is None else self._next.log_ns
        self._ahead: deque[tuple[int, int]] = deque()
        """Log time, and how far the robots' clock was ahead at least [ns]; falling."""
        self._publishers: dict[str, Publisher[Any] | None] = {}

    @property
    def start_ns(self) -> int:
        """When the first message was published."""
        return self._start_ns if self._next is None else self._next.publish_ns

    def reading(self, robot: str) -> ClockReading:
        """Nothing bounds what the fastest message took, unless a mirror was there."""
        offset_s = self._ahead[0][1] * 1e-9 if self._ahead else None
        return ClockReading(offset_s=offset_s, bound_s=0.0 if self._has_own else None)

    @property
    def over(self) -> bool:
        """Whether all has been played."""
        return self._next is None

    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        """Play what is there at the start."""
        self._run, self._clock = run, clock
        self._node = run.run.bus.create_node("rosbag2_player")
        self._play()

    def after_tick(self) -> Sequence[ClockChange]:
        """Play what was received up to now."""
        self._play()
        if not self._ahead:
            return ()
        log_ns = self._start_ns + self._run.run.world.time_ns
        set_by_ns = self._clock.follow(log_ns + self._ahead[0][1], 0)
        if 0 <= set_by_ns < _LARGEST_STEP_NS:
            return ()
        return (ClockChange(what="clock", set_by_ns=set_by_ns),)

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def _play(self) -> None:
        log_ns = self._start_ns + self._run.run.world.time_ns
        while self._next is not None and self._next.log_ns <= log_ns:
            message = self._next
            if message.topic.startswith(_OWN) or not self._has_own:
                self._learn(message)
            if message.topic in self._played:
                self._publish(message)
            self._next = next(self._messages, None)

    def _learn(self, message: BagMessage) -> None:
        ahead, window = message.publish_ns - message.log_ns, self._ahead
        if window and abs(ahead - window[0][1]) > _LARGEST_STEP_NS:
            window.clear()  # a clock was set
        while window and window[-1][1] <= ahead:
            window.pop()
        window.append((message.log_ns, ahead))
        while message.log_ns - window[0][0] > _WINDOW_NS:
            window.popleft()

    def _publish(self, message: BagMessage) -> None:
        if message.topic not in self._publishers:
            self._publishers[message.topic] = self._publisher(message.topic)
        publisher = self._publishers[message.topic]
        if publisher is not None and publisher.has_subscribers:
            try:
                publisher.publish(publisher.codec.decode(message.data), frozen=True)
            except BridgeError:
                self._node.get_logger().warn(f"{message.topic}: a message that cannot be read is left out")

    def _publisher(self, name: str) -> Publisher[Any] | None:
        """Return who publishes a topic again; None if its type is not known."""
        topic = complete(self._bag.topics[name])
        try:
            types.rihs01(topic.type)
            return self._node.create_publisher(codec(topic.type).cls, name, publisher_qos(topic.qos))
        except BridgeError:
            return None
