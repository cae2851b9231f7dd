"""Records the messages of a run in process, by simulated time: the same run is the same bytes."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from pathlib import Path
from typing import Any

from twin.bridge.bags import origins
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.bridge.bags.origins import Origins
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.bridge.bus import Bus
from twin.bridge.graph import Graph, is_hidden
from twin.bridge.topics import Publisher, Sample, Subscription
from twin.bridge.wire.external import Arrival
from twin.errors import RecordingError
from twin.files.writing import is_full

_OUTSIDE = -1


class BagTap:
    """A tap of a bus (`Bus.tap`) that writes a bag, and into it which node published each message."""

    def __init__(
        self,
        folder: Path,
        config: BagConfig | None = None,
        *,
        hidden: bool = False,
        on_loss: Callable[[RecordingError], None] | None = None,
    ) -> None:
        """Prepare for a bag; it is made when time first goes on, so a bus that fails before leaves none.

        Args:
            folder: Of the bag.
            config: How it is written.
            hidden: Whether topics of actions are recorded too: readers that know no names of their parts,
                as mcap-ros2-support, stop at them.
            on_loss: Called once if the bag cannot be written on, as the disk is full; what follows is not
                recorded, and what there is can be read as the bag of a process that was killed. None: it is
                raised.

        Raises:
            RecordingError: it exists already.
        """
        if folder.exists():
            raise RecordingError(f"{folder} exists already; name another bag, or remove it")
        self.folder = folder
        self._config = config
        self._hidden = hidden
        self._on_loss = on_loss
        self._writer: BagWriter | None = None
        self._bus: Bus | None = None
        self._graph = Graph()
        self._types: dict[str, str] = {}
        # What is published while nodes are made waits until all are there and tell their QoS.
        self._first: list[BagMessage] = []
        self._node_ids = array("l")
        self._names = {_OUTSIDE: ""}
        self._receivers: dict[str, object] = {}
        self._closed = False

    @property
    def count(self) -> int:
        """Messages so far."""
        return len(self._node_ids)

    def on_sample(self, sample: Sample[Any]) -> None:
        """Record one sample (a callback for `Bus.tap`).

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._closed or (is_hidden(sample.topic) and not self._hidden):
            return
        node, time_ns = sample.publisher.node, sample.time_ns
        self._bus = node.bus
        self._names[node.token.node_id] = node.fully_qualified_name
        message = BagMessage(sample.topic, sample.payload, time_ns, time_ns, sample.sequence)
        self._record(message, sample.msgtype, node.token.node_id)

    def wants(self, publisher: Publisher[Any]) -> bool:
        """Return whether it records a topic (for `Bus.needs`)."""
        return not self._closed and (self._hidden or not is_hidden(publisher.name))

    def on_arrival(self, arrival: Arrival) -> None:
        """Record one message from outside that a node subscribes to (for `Bus.arrival_taps`), only once.

        Raises:
            RecordingError: the disk is full or gone.
        """
        receiver, source = arrival.receiver, arrival.source
        if (
            self._closed
            or not isinstance(receiver, Subscription)
            or (is_hidden(receiver.name) and not self._hidden)
        ):
            return
        if self._receivers.setdefault(receiver.name, receiver) is not receiver:
            return  # every other subscription of the topic has it too
        self._bus = receiver.node.bus
        now_ns = receiver.node.now_ns
        payload, _ = arrival.data
        message = BagMessage(receiver.name, payload, now_ns, now_ns, source.sequence)
        self._record(message, receiver.codec.msgtype, _OUTSIDE)

    def close(self) -> None:
        """Write what is left, before the bus is closed. Harmless when repeated.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._closed:
            return
        try:
            writer = self._writer or self._begin()
            self._closed = True
            try:
                writer.attach(origins.NAME, origins.MEDIA_TYPE, self._origins().pack())
            finally:
                writer.close()
        except RecordingError as fault:
            self._lose(fault)

    def _lose(self, fault: RecordingError) -> None:
        """Record no more, and tell of it, or raise what keeps a bag from being begun, unless it is that."""
        self._closed = True
        if self._writer is not None:
            self._writer.leave()
        self._first.clear()
        if self._on_loss is None or (self._writer is None and not is_full(fault)):
            raise fault
        self._on_loss(fault)

    def _origins(self) -> Origins:
        nodes = self._bus.nodes if self._bus is not None else ()
        self._names.update((node.token.node_id, node.fully_qualified_name) for node in nodes)
        ids = sorted(self._names)
        places = {node_id: place for place, node_id in enumerate(ids)}
        return Origins(
            tuple(self._names[node_id] for node_id in ids),
            array("H", map(places.__getitem__, self._node_ids)),
        )

    def _record(self, message: BagMessage, msgtype: str, node_id: int) -> None:
        self._node_ids.append(node_id)
        self._types.setdefault(message.topic, msgtype)
        if self._writer is None and (not self._first or message.log_ns == self._first[0].log_ns):
            self._first.append(message)
            return
        try:
            self._write(self._writer or self._begin(), message)
        except RecordingError as fault:
            self._lose(fault)

    def _begin(self) -> BagWriter:
        self._writer = writer = BagWriter(self.folder, self._config)
        if self._bus is not None:
            self._graph = Graph.snapshot(self._bus)
        for message in self._first:
            self._write(writer, message)
        self._first.clear()
        return writer

    def _write(self, writer: BagWriter, message: BagMessage) -> None:
        name = message.topic
        if name not in writer.topics:
            if not self._graph.publishers(name) and self._bus is not None:  # a publisher made later
                self._graph = Graph.snapshot(self._bus)
            qos = tuple(OfferedQoS.of(offer.qos) for offer in self._graph.publishers(name))
            writer.add_topic(BagTopic(name=name, type=self._types[name], qos=qos))
        writer.write(message)
