"""Messages that are handed over as they are: only where nobody can tell, and both sides say so."""

from __future__ import annotations

from typing import Any

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import ColorRGBA, Time, Vector3
from twin.bridge.wire.session import SessionConfig
from twin.errors import BridgeError
from twin.savings import Savings


class Heard:
    """What two subscriptions that share and one that does not were given."""

    def __init__(self, bus: Bus, cls: type[Any]) -> None:
        self.bus = bus
        self.publisher = bus.create_node("talker").create_publisher(cls, "topic")
        self.own: list[Any] = []
        self.shared: list[Any] = []
        listener = bus.create_node("listener")
        listener.create_subscription(cls, "topic", self.own.append)
        for _ in range(2):
            listener.create_subscription(cls, "topic", self.shared.append, frozen=True)

    def after(self, message: Any, *, frozen: bool) -> Any:
        """Return the message that is shared, after one was published."""
        self.publisher.publish(message, frozen=frozen)
        self.bus.spin()
        (own,), (first, second) = self.own, self.shared
        assert first is second
        assert own is not first
        assert own is not message
        assert repr(own) == repr(first)
        return first


def test_a_frozen_message_is_the_one_that_is_heard(bus: Bus) -> None:
    message = Vector3(1.0, 2.0, 3.0)
    assert Heard(bus, Vector3).after(message, frozen=True) is message


def test_what_a_publisher_goes_on_to_change_is_not_heard(bus: Bus) -> None:
    message = Vector3(1.0, 2.0, 3.0)
    heard = Heard(bus, Vector3)
    heard.publisher.publish(message)
    message.x = 5.0
    bus.spin()
    assert {one.x for one in (*heard.own, *heard.shared)} == {1.0}


def test_numbers_are_heard_as_the_wire_has_them(bus: Bus) -> None:
    message = ColorRGBA(0.1, 0, 0.0, 1.0)
    assert Heard(bus, ColorRGBA).after(message, frozen=True) == ColorRGBA(0.10000000149011612, 0.0, 0.0, 1.0)


def test_a_number_that_does_not_fit_is_refused_where_it_is_published(bus: Bus) -> None:
    with pytest.raises(BridgeError, match="sec is a int32"):
        Heard(bus, Time).after(Time(2**31, 0), frozen=True)


def test_bytes_are_made_only_if_somebody_wants_them(bus: Bus, monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[Vector3] = []
    made: list[Any] = []
    publisher = bus.create_node("talker").create_publisher(Vector3, "topic")
    encode = publisher.codec.encode
    monkeypatch.setattr(publisher.codec, "encode", lambda m: made.append(m) or encode(m))  # type: ignore[func-returns-value]
    bus.create_node("listener").create_subscription(Vector3, "topic", heard.append, frozen=True)
    publisher.publish(Vector3(1.0, 2.0, 3.0), frozen=True)
    bus.spin()
    assert len(heard) == 1
    assert not made
    bus.tap(lambda sample: made.append(sample.payload))
    bus.tap(lambda sample: made.append(sample.payload))
    publisher.publish(Vector3(1.0, 2.0, 3.0), frozen=True)
    assert len(made) == 3  # encoded once, and seen twice


def test_without_the_saving_everybody_has_a_message_of_his_own() -> None:
    with Bus.of(SessionConfig(), Clock(), savings=Savings(by_reference=False)) as bus:
        heard = Heard(bus, Vector3)
        message = Vector3(1.0, 2.0, 3.0)
        heard.publisher.publish(message, frozen=True)
        bus.spin()
        everything = [message, *heard.own, *heard.shared]
        assert len({id(one) for one in everything}) == 4
        assert all(one == message for one in everything)
