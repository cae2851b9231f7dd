"""A link between publishers and those who hear them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Float32, String
from twin.bridge.topics.link import Carried, Link
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment


class Script:
    """A stage that does what it is told, message by message, and notes what it saw."""

    def __init__(self, *delays: Sequence[int]) -> None:
        self.delays, self.seen = list(delays), list[Carried]()

    def __call__(self, message: Carried) -> Sequence[int]:
        self.seen.append(message)
        return self.delays[len(self.seen) - 1]


@pytest.fixture
def link(bus: Bus) -> Link:
    """The link of the bus."""
    bus.link = Link(bus.clock)
    return bus.link


def tick(bus: Bus, clock: Clock, ms: int) -> None:
    """Go on in time, and let nodes run."""
    clock.now_ns += ms * 1_000_000
    bus.admit()
    bus.spin()


def test_messages_get_lost_and_come_late_and_twice(bus: Bus, clock: Clock, link: Link) -> None:
    node = bus.create_node("a")
    publisher = node.create_publisher(String, "words")
    heard: list[tuple[int, str]] = []
    tapped: list[tuple[int, str]] = []
    bus.create_node("b").create_subscription(String, "words", lambda m: heard.append((clock.now_ns, m.data)))
    bus.tap(lambda sample: tapped.append((sample.time_ns, sample.message.data)))
    script = Script((0,), (), (25_000_000,), (0, 5_000_000), (10_000_000,))
    link.stages.append(lambda m: script(m) if m.topic == "/words" else (0,))
    for word in ("now", "lost", "late", "twice", "soon"):
        publisher.publish(String(word))
    for _ in range(5):
        tick(bus, clock, 10)
    ms = 1_000_000
    assert heard == [
        (10 * ms, "now"),
        (10 * ms, "twice"),
        (10 * ms, "twice"),
        (10 * ms, "soon"),
        (30 * ms, "late"),
    ]
    assert sorted(tapped) == sorted(
        [(0, "now"), (0, "twice"), (10 * ms, "twice"), (10 * ms, "soon"), (30 * ms, "late")]
    ), "taps hear when and what a node would"
    assert [(m.topic, m.sender, m.sequence, m.is_heard) for m in script.seen] == [
        ("/words", "/a", n, True) for n in range(1, 6)
    ]


def test_delays_of_several_stages_add_up_for_each_copy(bus: Bus, clock: Clock, link: Link) -> None:
    publisher = bus.create_node("a").create_publisher(String, "words")
    times: list[int] = []
    bus.create_node("b").create_subscription(
        String, "words", lambda _: times.append(clock.now_ns // 1_000_000)
    )
    link.stages += [lambda _: (0, 20_000_000), lambda _: (10_000_000, 40_000_000)]
    publisher.publish(String("x"))
    for _ in range(7):
        tick(bus, clock, 10)
    assert times == [10, 30, 40, 60]


def test_a_late_message_is_as_it_was_though_its_publisher_changes_it(
    bus: Bus, clock: Clock, link: Link
) -> None:
    publisher = bus.create_node("a").create_publisher(Float32, "number")
    heard: list[float] = []
    tapped: list[float] = []
    bus.create_node("b").create_subscription(Float32, "number", lambda m: heard.append(m.data))
    bus.tap(lambda sample: tapped.append(sample.message.data))
    link.stages.append(lambda _: (10_000_000,))
    message = Float32(data=1.0)
    publisher.publish(message)
    message.data = 2.0
    tick(bus, clock, 10)
    assert heard == tapped == [1.0]


def test_what_a_destroyed_publisher_said_does_not_come_any_more(bus: Bus, clock: Clock, link: Link) -> None:
    node = bus.create_node("a")
    publisher = node.create_publisher(String, "words")
    heard: list[Any] = []
    bus.create_node("b").create_subscription(String, "words", heard.append)
    link.stages.append(lambda _: (10_000_000,))
    publisher.publish(String("x"))
    node.destroy_publisher(publisher)
    tick(bus, clock, 20)
    assert heard == []


def test_what_comes_from_other_processes_goes_through_it_too(bus: Bus, clock: Clock, link: Link) -> None:
    heard: list[str] = []
    subscription = bus.create_node("b").create_subscription(String, "words", lambda m: heard.append(m.data))
    arrived: list[int] = []
    bus.arrival_taps.append(lambda arrival: arrived.append(arrival.source.sequence))
    script = Script((), (15_000_000,), (0,))
    link.stages.append(script)
    for sequence, word in enumerate(("lost", "late", "now"), 1):
        source = Attachment(sequence, 0, bytes(16))
        payload = subscription.codec.encode(String(word))
        bus.external.push(Arrival(source, subscription, (payload, source), len(payload)))
    tick(bus, clock, 10)
    assert heard == ["now"]
    tick(bus, clock, 20)
    assert heard == ["now", "late"]
    assert arrived == [3, 2], "as a bag sees them"
    assert [(m.topic, m.sender, m.sequence) for m in script.seen] == [("/words", "", n) for n in (1, 2, 3)]
