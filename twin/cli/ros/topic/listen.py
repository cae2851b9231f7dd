"""What listening commands have in common: a subscription of a type that is found out first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import typer

from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.cdr.codec import Codec
    from twin.bridge.graph import EndpointInfo
    from twin.bridge.qos import QoS
    from twin.bridge.topics.raw import RawSample
    from twin.cli.ros.topic.process import TopicProcess

_INBOX = 1000
"""Messages kept while others are handled; a QoS depth of 5 would lose some of a burst."""


class Listener:
    """Hears one topic: bytes, and messages if the type is known."""

    def __init__(
        self, process: TopicProcess, name: str, typename: str, type_hash: str, cls: type[Any] | None
    ) -> None:
        from twin.bridge.cdr.codec import codec

        self.name = name
        self._process = process
        self._type, self._type_hash = typename, type_hash
        self._codec: Codec[Any] | None = codec(cls) if cls is not None else None
        self._told: set[str] = set()

    @classmethod
    def of_topic(
        cls, process: TopicProcess, name: str, endpoints: Sequence[EndpointInfo], message: type[Any] | None
    ) -> Listener:
        """Listen to a topic that exists; without a class only to its bytes."""
        from twin.bridge.tools.unknown_types import hash_of

        return cls(process, name, endpoints[0].type, hash_of(endpoints[0]), message)

    @classmethod
    def of_type(cls, process: TopicProcess, name: str, typename: str) -> Listener:
        """Listen to messages of a known type, whether somebody publishes yet or not.

        Raises:
            BridgeError: an unknown type, or others publish or expect another one.
        """
        from twin.bridge import types

        full = "/".join(types.parts(typename))
        if types.parts(full).kind != "msg":
            raise BridgeError(f"{full} is no message; topics carry package/msg/Name")
        matching = process.endpoints(name)
        others = [e for e in matching if e.type != full]
        if others:
            raise BridgeError(f"{name} carries {others[0].type}, not {full}")
        message = process.message_class(matching) if matching else types.get(full)
        return cls(process, name, full, types.rihs01(full), message)

    def listen(self, qos: QoS, callback: Callable[[RawSample], Any]) -> None:
        """Call back for every sample of the topic's type."""
        from twin.bridge.topics.raw import RawSubscription
        from twin.bridge.topics.raw_publisher import Presence

        node = self._process.node
        Presence(node, "MS", self.name, self._type, self._type_hash, qos)
        kept = qos if qos.durability == "transient_local" else replace(qos, depth=max(qos.depth, _INBOX))

        def on_sample(sample: RawSample) -> None:
            if self._is_ours(sample):
                callback(sample)

        node.add_endpoint(RawSubscription(node, self.name, on_sample, kept))

    def decode(self, sample: RawSample) -> Any | None:
        """Return the message, None if the bytes are none: that is said once."""
        from twin.bridge.wire.admission import read_start

        assert self._codec is not None
        try:
            return read_start(self._process.live.bus.external, self.name, self._codec, sample.payload)
        except Exception as error:  # whatever the bytes were, they are not our bug
            self._tell("payload", f"a message on {self.name} is no {self._type}: {error}")
            return None

    def _is_ours(self, sample: RawSample) -> bool:
        from twin.bridge.tools.unknown_types import same_hash

        if sample.type == self._type and same_hash(sample.type_hash, self._type_hash):
            return True
        if sample.type != self._type:
            self._tell(sample.type, f"somebody publishes {sample.type} on {self.name}, not {self._type}")
        else:
            self._tell(
                sample.type_hash,
                f"somebody publishes another definition of {self._type} on {self.name} ({sample.type_hash})",
            )
        return False

    def _tell(self, what: str, sentence: str) -> None:
        if what not in self._told:
            self._told.add(what)
            typer.echo(f"WARNING: {sentence}; left out, said once", err=True)
