"""A message on its way: what taps are shown, and what waits in the inboxes of this process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from twin.bridge import types
from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.wire.keys import Attachment

if TYPE_CHECKING:
    from twin.bridge.topics import Publisher

M = TypeVar("M")


class Sample(Generic[M]):
    """A message as published. What it says is settled before taps and receivers have it."""

    __slots__ = ("_payload", "_shared", "message", "msgtype", "publisher", "sequence", "time_ns", "topic")

    def __init__(self, publisher: Publisher[M], sequence: int, time_ns: int, message: M) -> None:
        self.publisher = publisher
        self.sequence = sequence
        """The publisher's count, from 1."""
        self.topic: str = publisher.name
        """Absolute name."""
        self.msgtype: str = publisher.msgtype
        self.time_ns = time_ns
        """Simulated time of publishing [ns]."""
        self.message = message
        """The publisher's own object: not to be changed, nor kept, as the publisher may change it."""
        self._payload: bytes | None = None
        self._shared: M | None = None

    def settle(self, frozen: bool) -> None:
        """Let what is received be the message as it is now; one that is frozen need not become bytes yet."""
        if self._shared is None and self._payload is None:
            if frozen and self.publisher.codec.is_exact(self.message):
                self._shared = self.message
            else:
                _ = self.payload

    @property
    def shared(self) -> M:
        """What is received, the same object for all who do not change it."""
        if self._shared is None:
            self._shared = self.publisher.codec.decode(self.payload)
        return self._shared

    @property
    def source(self) -> Attachment:
        """Count, time and gid of the publisher."""
        return Attachment(self.sequence, self.time_ns, self.publisher.gid)

    @property
    def payload(self) -> bytes:
        """The message as CDR, made when first asked for unless the publisher may change the message."""
        if self._payload is None:
            self._payload = self.publisher.codec.encode(self.message)
        return self._payload


class ReceivedSample(Sample[Any]):
    """A message that was published in another process; decoded when first looked at."""

    __slots__ = ("_decoded",)

    def __init__(self, publisher: Any, sequence: int, time_ns: int, payload: bytes) -> None:
        self.publisher = publisher
        self.sequence = sequence
        self.topic = publisher.name
        self.msgtype = publisher.msgtype
        self.time_ns = time_ns
        self._payload = payload
        self._shared = self._decoded = None

    @property
    def message(self) -> Any:
        """The message.

        Raises:
            BridgeError: this process does not know its type.
        """
        if self._decoded is None:
            decoder: Codec[Any] = codec(types.get(self.msgtype))
            self._decoded = decoder.decode(self.payload)
        return self._decoded
