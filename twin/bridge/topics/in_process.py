"""Messages that need not go through Zenoh, since all who hear them are subscriptions of the same bus."""

from __future__ import annotations

from typing import Protocol

from twin.bridge.wire.keys import Attachment


class Receiver(Protocol):
    """A subscription."""

    def enqueue(self, data: tuple[bytes, Attachment], external: bool) -> None:
        """Put a payload and its source into the node's inbox."""


class Line:
    """Who hears one key."""

    __slots__ = ("_exchange", "receivers", "through_zenoh")

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self.receivers: list[Receiver] = []
        """Those who can be given a message directly; Zenoh reaches them too."""
        self.through_zenoh = 0
        """How many Zenoh alone can reach: those who want to hear what was said before they came."""

    @property
    def is_direct(self) -> bool:
        """Whether the receivers are all who hear the key."""
        return not self.through_zenoh and self._exchange.is_private


class Exchange:
    """Who hears what on a bus that has no network.

    A message that Zenoh carries from one node of a process to another costs several times as much as one that
    is put into the inbox directly.
    """

    def __init__(self, is_private: bool) -> None:
        self.is_private = is_private
        """Whether nobody can hear a topic of whom the exchange does not know."""
        self._lines: dict[str, Line] = {}

    def line(self, key: str) -> Line:
        """Return who hears a key, now and later."""
        return self._lines.setdefault(key, Line(self))
