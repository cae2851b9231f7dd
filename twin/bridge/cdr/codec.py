"""Messages to CDR bytes and back.

What follows a message is ignored, as in ROS 2: its own serializer returns a buffer of an estimated size.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Generic, TypeVar

from twin.bridge import types
from twin.bridge.cdr.decoder import decoder
from twin.bridge.cdr.encoder import encoder
from twin.bridge.cdr.exact import exactness
from twin.bridge.cdr.maker import MAGIC
from twin.bridge.messages.from_values import checked

M = TypeVar("M")


class Codec(Generic[M]):
    """How one message type travels; its code is made for the first message, not for each type declared."""

    def __init__(self, msg_type: type[M] | str) -> None:
        self._given = msg_type
        # Attributes that the first message replaces: a `cached_property` takes longer to look up.
        self.is_exact: Callable[[Any], bool] = self._first_is_exact
        """Tells whether a message is what would be decoded from its bytes; see `exactness`."""
        self._encode: Callable[[Any], bytes] = self._first_encode
        self.msgtype: str = msg_type if isinstance(msg_type, str) else msg_type.__msgtype__  # type: ignore[attr-defined]
        """package/msg/Name."""

    @cached_property
    def cls(self) -> type[M]:
        """The messages' class."""
        return types.get(self._given) if isinstance(self._given, str) else self._given

    def encode(self, message: M) -> bytes:
        """Return a message as CDR; what can be repaired, such as a list of numbers, is.

        Raises:
            BridgeError: a field has a value that it cannot hold; names the field.
        """
        try:
            return self._encode(message)
        except Exception:
            return self._encode(checked(message))

    def _first_is_exact(self, message: Any) -> bool:
        self.is_exact = exactness(self.msgtype)
        return self.is_exact(message)

    def _first_encode(self, message: Any) -> bytes:
        self._encode = encoder(self.msgtype)
        return self._encode(message)

    def read(self, payload: bytes) -> tuple[M, int]:
        """Return the message that a payload begins with, and where it ends.

        Raises on bytes that do not begin with such a message; which exception is not specified. Takes no more
        memory than some times the payload, whatever lengths the payload tells.
        """
        if payload[:2] != MAGIC[:2]:
            if payload[:2] != b"\0\0":
                raise ValueError("it does not begin with the encapsulation of plain CDR")
            return decoder(self.msgtype, ">")(payload)
        return decoder(self.msgtype, "<")(payload)

    def decode(self, payload: bytes) -> M:
        """Return the message; raises what `read` does."""
        return self.read(payload)[0]


def codec(msg_type: type[M] | str) -> Codec[M]:
    """Return the codec of a message class; by its full name the class is not made before it is needed."""
    return Codec(msg_type)
