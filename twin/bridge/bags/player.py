"""Plays bags into a live graph: raw bytes, with the recorded types and QoS, in the recorded rhythm."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from twin.bridge import names
from twin.bridge.bags.definitions import complete
from twin.bridge.bags.metadata import BagMessage
from twin.bridge.bags.offered_qos import publisher_qos
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.topic_choice import TopicChoice
from twin.bridge.graph import Graph
from twin.bridge.live import LiveBus
from twin.bridge.msgs import Clock, new, stamp
from twin.bridge.topics.raw_publisher import RawPublisher
from twin.bridge.types import ServiceType
from twin.errors import RecordingError

_NS = 1_000_000_000
_MATCHING_NS = _NS
"""Subscribers that are there are waited for at most so long."""
_CLOCK = "/clock"
_LONGEST_WAIT_S = 0.1


@dataclass(frozen=True, kw_only=True)
class PlayerConfig:
    """What is played, and how."""

    rate: float = 1.0
    """Bag seconds per second."""
    loop: bool = False
    start_offset_ns: int = 0
    """Where to begin, after the first message; what was latched before comes at once."""
    duration_ns: int | None = None
    """How much to play of the bag's time, None for all."""
    until_ns: int | None = None
    """Log time of the last message [ns]."""
    topics: TopicChoice = field(default_factory=TopicChoice)
    remap: Mapping[str, str] = field(default_factory=dict)
    """Topic in the bag -> topic to publish on."""
    clock_hz: float | None = None
    """How often to publish `/clock` from the bag's time; a recorded one is left out then."""
    delay_s: float = 0.0
    """Wall time before each round [s]."""
    start_paused: bool = False


class Player:
    """Node `/rosbag2_player` with services to pause, resume and change the rate, as rosbag2's."""

    def __init__(self, bag: BagReader, process: LiveBus, config: PlayerConfig | None = None) -> None:
        """Offer the topics.

        Raises:
            RecordingError: the bag lacks a topic that is asked for, or ends before the start; a rate of zero.
            BridgeError: a remapping to what is no name of a topic.
        """
        self.config = config or PlayerConfig()
        if not 0.0 < self.config.rate < float("inf"):
            raise RecordingError(f"a rate of {self.config.rate:g}; valid is more than zero")
        self.bag = bag
        self.played = 0
        """Messages published."""
        self.left_out: list[str] = []
        """Topics that cannot be published, for want of their type's hash."""
        self._process = process
        self._rate = self.config.rate
        self.paused = self.config.start_paused
        """Whether the bag's time stands still."""
        self._start_ns, self._end_ns = self._window()
        # The bag's time is `_bag_ns` at the wall's `_wall_ns`, and goes on from there.
        self._wall_ns, self._bag_ns = time.monotonic_ns(), self._start_ns
        self._node = process.bus.create_node("rosbag2_player")
        chosen = [
            name for name in self.config.topics.of(bag.topics) if not (name == _CLOCK and self._clocked)
        ]
        self._publishers = {name: p for name in chosen if (p := self._publisher(name)) is not None}
        self._clock_publisher = self._node.create_publisher(Clock, _CLOCK, 1) if self._clocked else None
        self._offer_services()

    def play(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Play to the end, or until `stop`; return when all is published.

        Raises:
            RecordingError: the bag is damaged.
        """
        if self._clock_publisher is not None:
            period_ns = round(_NS / (self.config.clock_hz or 1.0))
            self._node.create_timer(period_ns, self._publish_clock)
        self._wait_for_subscribers(stop)
        while True:
            self._anchor(self._start_ns)
            self._process.spin(stop, self.config.delay_s)
            self._anchor(self._start_ns)
            self._publish_clock()
            self._publish_latched(stop)
            self._play_once(stop)
            if stop() or not self.config.loop:
                return

    def pause(self) -> None:
        """Stop the bag's time."""
        self._anchor(self.now_ns)
        self.paused = True

    def resume(self) -> None:
        """Let the bag's time go on."""
        self._anchor(self.now_ns)
        self.paused = False

    def set_rate(self, rate: float) -> bool:
        """Change the speed; return whether it is valid."""
        if not 0.0 < rate < float("inf"):
            return False
        self._anchor(self.now_ns)
        self._rate = rate
        return True

    @property
    def now_ns(self) -> int:
        """The bag's time [ns]."""
        if self.paused:
            return self._bag_ns
        return self._bag_ns + int((time.monotonic_ns() - self._wall_ns) * self._rate)

    @property
    def _clocked(self) -> bool:
        return self.config.clock_hz is not None

    def _window(self) -> tuple[int, int]:
        info, config = self.bag.info, self.config
        start = info.start_ns + config.start_offset_ns
        ends = [info.end_ns]
        ends += [] if config.duration_ns is None else [start + config.duration_ns]
        ends += [] if config.until_ns is None else [config.until_ns]
        if info.count and start > info.end_ns:
            raise RecordingError(
                f"{self.bag.path}: a start offset of {config.start_offset_ns / _NS:g} s is after its end; "
                f"it is {info.duration_ns / _NS:g} s long"
            )
        return start, min(ends)

    def _publisher(self, name: str) -> RawPublisher | None:
        target = names.expand(self.config.remap.get(name, name), "/", "rosbag2_player")
        topic = complete(self.bag.topics[name])
        if not topic.type_hash:
            self.left_out.append(name)
            return None
        return RawPublisher(self._node, target, topic.type, topic.type_hash, publisher_qos(topic.qos))

    def _anchor(self, bag_ns: int) -> None:
        self._wall_ns, self._bag_ns = time.monotonic_ns(), bag_ns

    def _wait_for_subscribers(self, stop: Callable[[], bool]) -> None:
        """Wait until Zenoh knows the way to subscribers that are in the graph; what comes before is lost."""
        graph = Graph.snapshot(self._process.bus)
        there = [p for p in self._publishers.values() if graph.subscriptions(p.name)]
        self._process.spin(lambda: stop() or all(p.has_subscribers for p in there), _MATCHING_NS / _NS)

    def _publish_latched(self, stop: Callable[[], bool]) -> None:
        """Publish what late subscribers would have got at the start offset."""
        latched = [name for name, p in self._publishers.items() if p.qos.durability == "transient_local"]
        if self.config.start_offset_ns == 0 or not latched:
            return
        kept: dict[str, deque[tuple[int, BagMessage]]] = {
            name: deque(maxlen=self._publishers[name].qos.depth) for name in latched
        }
        for number, message in enumerate(self.bag.messages(latched, end_ns=self._start_ns - 1)):
            kept[message.topic].append((number, message))
        for _, message in sorted(item for queue in kept.values() for item in queue):
            if not stop():
                self._publish(message)

    def _play_once(self, stop: Callable[[], bool]) -> None:
        for message in self.bag.messages(self._publishers, self._start_ns, self._end_ns):
            while not stop() and (wait_ns := message.log_ns - self.now_ns) > 0:
                wall_s = wait_ns / self._rate / _NS
                self._process.spin_once(_LONGEST_WAIT_S if self.paused else min(wall_s, _LONGEST_WAIT_S))
            if stop():
                return
            self._publish(message)
        self._process.spin_once(0.0)

    def _publish(self, message: BagMessage) -> None:
        self._publishers[message.topic].publish(message.data)
        self.played += 1

    def _publish_clock(self) -> None:
        if self._clock_publisher is not None:
            self._clock_publisher.publish(Clock(stamp(max(0, self.now_ns))))

    def _offer_services(self) -> None:
        answers: dict[str, tuple[str, Callable[[Any], dict[str, Any] | None]]] = {
            "pause": ("Pause", lambda request: self.pause()),
            "resume": ("Resume", lambda request: self.resume()),
            "toggle_paused": (
                "TogglePaused",
                lambda request: self.resume() if self.paused else self.pause(),
            ),
            "is_paused": ("IsPaused", lambda request: {"paused": self.paused}),
            "set_rate": ("SetRate", lambda request: {"success": self.set_rate(request.rate)}),
            "get_rate": ("GetRate", lambda request: {"rate": self._rate}),
        }
        for name, (kind, answer) in answers.items():
            service = ServiceType(f"rosbag2_interfaces/srv/{kind}")
            self._node.create_service(service, f"~/{name}", partial(_respond, service, answer))


def _respond(service: ServiceType, answer: Callable[[Any], dict[str, Any] | None], request: Any) -> Any:
    return new(service.Response, **(answer(request) or {}))
