"""Physical robots as a bag has them: the same messages at the same ticks, every time."""

from __future__ import annotations

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
from twin.live.mirror.least_delay import LeastDelay
from twin.live.mirror.robot_clocks import RobotClocks
from twin.live.mirror.source import ClockChange, ClockReading, Source

if TYPE_CHECKING:
    from twin.live.mirror.followed_clock import FollowedClock
    from twin.runtime.open_run import OpenRun

_OWN = "/twin/"
_NOT_PLAYED = ("/clock", "/rosout", "/parameter_events", "/diagnostics")
_LARGEST_STEP_NS = 500_000_000


class BagSource(Source):
    """A bag's messages by the time at which they were received.

    The robot's clock is that of the times of publishing. It is ahead of the recorder's by what the fastest
    message of the last seconds tells; a mirror's own messages, if the bag has some, tell it best. Each of
    several robots has its own, and the mirror's is the recorder's.
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
        self._ahead: dict[str, LeastDelay] = {}
        """Of each robot's clock to the recorder's."""
        self._robots: dict[str, str] = {}
        """By the beginning of their topics' names, if there are several."""
        self._clocks: RobotClocks | None = None
        self._publishers: dict[str, Publisher[Any] | None] = {}

    @property
    def start_ns(self) -> int:
        """When the first message was published."""
        return self._start_ns if self._next is None else self._next.publish_ns

    def reading(self, robot: str) -> ClockReading:
        """Nothing bounds what the fastest message took, unless a mirror was there."""
        ahead_ns = self._ahead[robot].ahead_ns
        is_bounded = self._has_own and self._clocks is None
        offset_s = None if ahead_ns is None else ahead_ns * 1e-9
        return ClockReading(offset_s=offset_s, bound_s=0.0 if is_bounded else None)

    @property
    def over(self) -> bool:
        """Whether all has been played."""
        return self._next is None

    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        """Play what is there at the start."""
        self._run, self._clock = run, clock
        stacks = run.run.parts.stacks
        self._ahead = {name: LeastDelay() for name in stacks}
        if len(stacks) > 1:
            spaces = {name: stack.context.namespace for name, stack in stacks.items()}
            self._robots = {f"{space}/": name for name, space in spaces.items()}
            self._clocks = RobotClocks(clock, spaces)
        self._node = run.run.bus.create_node("rosbag2_player")
        self._play()

    def after_tick(self) -> Sequence[ClockChange]:
        """Play what was received up to now."""
        self._play()
        elapsed_ns = self._run.run.world.time_ns
        log_ns = self._start_ns + elapsed_ns
        if self._clocks is None:
            (ahead,) = self._ahead.values()
            if ahead.ahead_ns is None:
                return ()
            set_by_ns = self._clock.follow(log_ns + ahead.ahead_ns, 0)
            if 0 <= set_by_ns < _LARGEST_STEP_NS:
                return ()
            return (ClockChange(what="clock", set_by_ns=set_by_ns),)
        self._clock.follow(log_ns, 0)
        known = {name: ahead.ahead_ns for name, ahead in self._ahead.items() if ahead.ahead_ns is not None}
        changes: list[ClockChange] = []
        for name, ahead_ns in known.items():
            changes += self._clocks.follow(name, elapsed_ns, log_ns + ahead_ns, 0)
        return changes

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def _play(self) -> None:
        log_ns = self._start_ns + self._run.run.world.time_ns
        while self._next is not None and self._next.log_ns <= log_ns:
            message = self._next
            self._learn(message)
            if message.topic in self._played:
                self._publish(message)
            self._next = next(self._messages, None)

    def _learn(self, message: BagMessage) -> None:
        if self._robots:
            space = message.topic[: message.topic.find("/", 1) + 1]
            robot = self._robots.get(space)
        else:
            is_best = message.topic.startswith(_OWN) or not self._has_own
            robot = next(iter(self._ahead)) if is_best else None
        if robot is not None:
            self._ahead[robot].take(message.publish_ns, message.log_ns)

    def _publish(self, message: BagMessage) -> None:
        if message.topic not in self._publishers:
            self._publishers[message.topic] = self._publisher(message.topic)
        publisher = self._publishers[message.topic]
        if publisher is not None and publisher.has_subscribers:
            try:
                told = publisher.codec.decode(message.data)
                if self._clocks is not None:
                    self._clocks.stamp_anew(message.topic, told)
                publisher.publish(told, frozen=True)
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
