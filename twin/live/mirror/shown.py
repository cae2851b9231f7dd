"""What a recording shows of a mirror: virtual robots as the world, physical ones as what is believed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from twin.bridge.topics import Subscription
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.topics import Sample
    from twin.bridge.wire.external import Arrival
    from twin.recording.sink import RerunSink
    from twin.sim.world import World

LABEL = "/mission/label"
"""The label stands beside what the mission is at."""


class _Shown:
    """A sample of another name and time."""

    def __init__(self, topic: str, time_ns: int, sample: Any) -> None:
        self.topic, self.time_ns, self._sample = topic, time_ns, sample
        self.msgtype, self.message = sample.msgtype, sample.message

    @property
    def payload(self) -> bytes:
        """CDR, made only if it is asked for."""
        payload: bytes = self._sample.payload
        return payload


class Shown:
    """Passes messages on to a recording: at simulated time, without the virtual robot's own."""

    def __init__(self, namespace: str) -> None:
        """Take the namespace of virtual robots."""
        self._own, self._label = f"{namespace}/", f"{namespace}/label"
        self._sink: RerunSink | None = None
        self._world: World | None = None
        self._latest: dict[tuple[str, bytes], int] = {}

    def tap(self, sink: RerunSink) -> Any:
        """Return what takes the samples of this process."""
        self._sink = sink
        return self._on_sample

    def begin(self, world: World) -> None:
        """Take the world, whose time is that of the recording."""
        self._world = world

    def on_arrival(self, arrival: Arrival) -> None:
        """Show what came from another process, once however many hear it."""
        receiver, source = arrival.receiver, arrival.source
        if self._sink is None or not isinstance(receiver, Subscription):
            return
        key = receiver.name, source.gid
        if receiver.name.startswith(self._own) or self._latest.get(key, -1) >= source.sequence:
            return
        self._latest[key] = source.sequence
        msgtype = receiver.codec.msgtype
        if self._sink.shows(msgtype):
            payload, _ = arrival.data
            try:
                message = receiver.codec.decode(payload)
            except BridgeError:
                return  # whoever reads it says so
            self._show(receiver.name, SimpleNamespace(msgtype=msgtype, message=message, payload=payload))

    def _on_sample(self, sample: Sample[Any]) -> None:
        if sample.topic == self._label:
            self._show(LABEL, sample)
        elif not sample.topic.startswith(self._own):
            self._show(sample.topic, sample)

    def _show(self, topic: str, sample: Any) -> None:
        assert self._sink is not None
        if self._sink.shows(sample.msgtype):
            shown: Any = _Shown(topic, 0 if self._world is None else self._world.time_ns, sample)
            self._sink.on_sample(shown)
