"""Lock-step with a process that knows nothing of it: one sample for every sample that it is sent."""

from __future__ import annotations

import queue
import time
from dataclasses import dataclass, replace
from typing import Any

import zenoh

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.graph import EndpointInfo, Graph, NodeInfo
from twin.bridge.lockstep.mirror import mirrored_publisher
from twin.bridge.lockstep.protocol import carried
from twin.bridge.lockstep.stepper import patience
from twin.bridge.topics import ReceivedSample, Sample
from twin.bridge.wire.keys import parse_attachment
from twin.bridge.wire.session import direct
from twin.errors import BridgeError

_POLL_S = 0.02
_NAMELESS = NodeInfo("/", "", "", "")


@dataclass(frozen=True, kw_only=True)
class AnswerConfig:
    """Which topic is waited for."""

    topic: str
    """What the other process publishes, absolute: '/cmd_vel'."""
    stimulus: str
    """What it answers, absolute: '/odom'; as many samples are waited for as this topic had."""
    timeout_s: float = 10.0
    """How long to wait [s] of wall time."""


class AnswerTopic:
    """Waits for what another process answers, and publishes it as if a node of the run did."""

    def __init__(self, bus: Bus, config: AnswerConfig) -> None:
        """Hear what the process publishes, and count what it answers.

        Raises:
            BridgeError: no node of the run subscribes to the topic, or none publishes the stimulus.
        """
        self.config = config
        self._bus = bus
        self._due = 0
        self._arrived: queue.SimpleQueue[tuple[bytes, bytes]] = queue.SimpleQueue()
        self.surplus = 0
        """Samples that nobody waited for: with them, which one answers what depends on the wall clock."""
        self._graph = Graph.watch(bus)
        listener = self._listener = self._own("MS", config.topic)
        talker = self._own("MP", config.stimulus)
        drop = zenoh.CongestionControl.DROP
        answer = f"{bus.domain_id}{config.topic}/{types.dds_name(listener.type)}/{listener.type_hash}"
        self._publisher: Any = bus.session.declare_publisher(answer, congestion_control=drop)
        self._subscriber: Any = bus.session.declare_subscriber(answer, direct(self._on_sample))
        stimulus = f"{bus.domain_id}{config.stimulus}/{types.dds_name(talker.type)}/{talker.type_hash}"
        self._probe: Any = bus.session.declare_publisher(
            stimulus, allowed_destination=zenoh.Locality.REMOTE, congestion_control=drop
        )
        bus.tap(self._on_own_sample)

    def wait_until_present(self) -> None:
        """Wait for a process that hears the stimulus, and publishes the topic if it tells what it does.

        Raises:
            BridgeError: none in time.
        """
        config = self.config
        for _ in patience(config.timeout_s, f"somebody who publishes {config.topic}"):
            if self._is_present():
                return
            time.sleep(_POLL_S)
        raise BridgeError(
            f"within {config.timeout_s:g} s nobody has joined who hears {config.stimulus} and publishes "
            f"{config.topic}; start it, or name another stimulus: --wait-for {config.topic}@TOPIC"
        )

    def step(self, tick: int) -> None:
        """Wait for as many samples as the stimulus had since the last call, and publish them.

        Raises:
            BridgeError: one does not come in time.
        """
        end = time.monotonic() + self.config.timeout_s
        for _ in range(self._due):
            try:
                payload, attachment = self._arrived.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                raise BridgeError(self._late(tick)) from None
            sample = self._sample(payload, attachment)
            for tap in self._bus.taps:
                tap(sample)
            self._publisher.put(payload, attachment=attachment)
        self._due = 0

    def close(self) -> None:
        """Hear nothing any more. Harmless when repeated."""
        if self._on_own_sample in self._bus.taps:
            self._bus.taps.remove(self._on_own_sample)
        self._graph.close()
        for entity in (self._subscriber, self._publisher, self._probe):
            entity.undeclare()

    def _sample(self, payload: bytes, attachment: bytes) -> ReceivedSample:
        source = parse_attachment(attachment)
        assert source is not None
        known = [e for e in self._graph.publishers(self.config.topic) if e.gid == source.gid]
        # Who declares no tokens is told as a nameless node.
        info = known[0] if known else replace(self._listener, node=_NAMELESS, gid=source.gid)
        mirrored = mirrored_publisher(self._bus, info)
        return ReceivedSample(mirrored, source.sequence, self._bus.clock.now_ns, payload)

    def _late(self, tick: int) -> str:
        config = self.config
        foreign = [e for e in self._graph.publishers(config.topic) if not self._is_own(e)]
        who = ", ".join(sorted({e.node.full_name for e in foreign}))
        publisher = f"published by {who}" if who else "nobody in the graph publishes it now"
        return (
            f"the topic {config.topic} had no answer to {config.stimulus} in tick {tick} "
            f"(t = {self._bus.clock.now_ns * 1e-9:.3f} s) within {config.timeout_s:g} s ({publisher}); "
            "--wait-timeout gives it more time"
        )

    def _is_present(self) -> bool:
        if not self._probe.matching_status.matching:
            return False
        own = {self._bus.session_id}
        hear = {e.node.session_id for e in self._graph.subscriptions(self.config.stimulus)} - own
        speak = {e.node.session_id for e in self._graph.publishers(self.config.topic)} - own
        # Who declares no tokens tells nobody what it publishes.
        return bool(hear & speak) or not hear

    def _own(self, kind: str, name: str) -> EndpointInfo:
        verb = "subscribes to" if kind == "MS" else "publishes"
        for endpoint in self._graph.endpoints:
            if endpoint.kind == kind and endpoint.name == name and self._is_own(endpoint):
                return endpoint
        raise BridgeError(
            f"--wait-for {self.config.topic}@{self.config.stimulus}: no node of the run {verb} {name}"
        )

    def _is_own(self, endpoint: EndpointInfo) -> bool:
        return endpoint.node.session_id == self._bus.session_id

    def _on_own_sample(self, sample: Sample[Any]) -> None:
        if sample.topic == self.config.stimulus:
            if not self._due:
                self.surplus += self._arrived.qsize()
            self._due += 1

    def _on_sample(self, sample: zenoh.Sample) -> None:
        if self._bus.in_own_thread():
            return
        attachment, payload = carried(sample)
        if parse_attachment(attachment) is None:
            self._bus.external.refuse("attachment", self.config.topic, "no rmw_zenoh attachment of 33 bytes")
        else:
            self._arrived.put((payload, attachment))
