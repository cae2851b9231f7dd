"""Messages that need not go through Zenoh, since all who hear them are subscriptions of the same bus."""

from __future__ import annotations

from twin.bridge.wire.external import Receiver


class Listeners:
    """Who hears one key."""

    __slots__ = ("every", "receivers", "through_zenoh")

    def __init__(self, every: InProcess) -> None:
        self.every = every
        self.receivers: list[Receiver] = []
        """Those who can be given a message directly; Zenoh reaches them too."""
        self.through_zenoh = 0
        """How many Zenoh alone can reach: those who want to hear what was said before they came."""

    @property
    def is_direct(self) -> bool:
        """Whether the receivers are all who hear the key."""
        return not self.through_zenoh and self.every.is_private


class InProcess:
    """Who hears what on a bus that has no network.

    A message that Zenoh carries from one node of a process to another costs several times as much as one that
    is put into the inbox directly.
    """

    def __init__(self, is_private: bool) -> None:
        self.is_private = is_private
        """Whether nobody can hear a topic who is not known here."""
        self._listeners: dict[str, Listeners] = {}

    def listeners(self, key: str) -> Listeners:
        """Return who hears a key, now and later."""
        return self._listeners.setdefault(key, Listeners(self))
