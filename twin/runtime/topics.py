"""Topics that checks look at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.topics import Publisher, Sample, Subscription
from twin.bridge.wire.external import Arrival
from twin.scenario.checks import Check


def topic_types(bus: Bus) -> dict[str, str]:
    """Return the message types of all topics that nodes of the bus publish or hear, by name."""
    both = [e for node in bus.nodes for e in node.endpoints if isinstance(e, Publisher | Subscription)]
    return {endpoint.name: endpoint.codec.msgtype for endpoint in both}


def watch_topics(bus: Bus, checks: Sequence[Check]) -> None:
    """Give checks the fields that they look at of every message, as it is published: nothing is decoded.

    A message from outside has the time of the tick in which it was admitted.
    """
    takers: dict[tuple[str, str], list[Callable[[int, Any], None]]] = {}
    for check in checks:
        for name, reader in check.topics.items():
            takers.setdefault((reader.topic, reader.msgtype), []).append(
                partial(_give, check, name, reader.read)
            )

    def on_sample(sample: Sample[Any]) -> None:
        for take in takers.get((sample.topic, sample.msgtype), ()):
            take(sample.time_ns, sample.message)

    def on_arrival(arrival: Arrival) -> None:
        receiver = arrival.receiver
        if not isinstance(receiver, Subscription) or _key(receiver) not in takers:
            return
        with suppress(Exception):  # what is no message is counted where it is received
            message, _ = receiver.codec.read(arrival.data[0])
            for take in takers[_key(receiver)]:
                take(bus.clock.now_ns, message)

    for endpoint in (endpoint for node in bus.nodes for endpoint in node.endpoints):
        if isinstance(endpoint, Publisher) and _key(endpoint) in takers:
            for sample in endpoint.retained(1):
                on_sample(sample)
    bus.tap(on_sample)
    bus.needs.append(lambda publisher: _key(publisher) in takers)
    bus.arrival_taps.append(on_arrival)


def _key(endpoint: Publisher[Any] | Subscription[Any]) -> tuple[str, str]:
    return endpoint.name, endpoint.codec.msgtype


def _give(check: Check, name: str, read: Callable[[Any], Any], time_ns: int, message: Any) -> None:
    value = read(message)
    if value is not None:
        check.take(name, time_ns, value)
