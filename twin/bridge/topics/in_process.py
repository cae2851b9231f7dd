"""Messages that need not go through Zenoh, since all who hear them are subscriptions of the same bus."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

from twin.bridge.wire.external import Receiver


class Member(Receiver, Protocol):
    """A receiver of a group of nodes."""

    group: str
    """Of its node."""


class Latched(Protocol):
    """A publisher whose last messages are for those who come later, too."""

    def retained(self, most: int) -> list[Any]:
        """Return the last of its samples, at most so many."""

    def put_retained(self) -> None:
        """Put them into Zenoh."""


class Listeners:
    """Who hears one key."""

    __slots__ = ("every", "latched", "receivers")

    def __init__(self, every: InProcess) -> None:
        self.every = every
        self.receivers: list[Member] = []
        """Those who can be given a message directly; Zenoh reaches them too."""
        self.latched: list[Latched] = []
        """Who has something for those who come later."""

    @property
    def is_direct(self) -> bool:
        """Whether the receivers are all who hear the key."""
        return self.every.is_private

    def retained(self, most: int) -> Iterator[Any]:
        """Yield what is for a receiver that comes now: of each publisher at most so many samples."""
        for publisher in self.latched:
            yield from publisher.retained(most)


class InProcess:
    """Who hears what on a bus that has no network.

    A message that Zenoh carries from one node of a process to another costs several times as much as one that
    is put into the inbox directly.
    """

    def __init__(self, is_private: bool) -> None:
        self.is_private = is_private
        """Whether nobody can hear a topic who is not known here."""
        self.is_deaf = False
        """Whether what Zenoh delivers was heard before."""
        self._listeners: dict[str, Listeners] = {}

    def listeners(self, key: str) -> Listeners:
        """Return who hears a key, now and later."""
        return self._listeners.setdefault(key, Listeners(self))

    def join(self, key: str, other: str) -> None:
        """Let two keys be one; all who hear them are known here."""
        mine, theirs = self.listeners(key), self.listeners(other)
        # The same lists: several keys may be joined with one.
        theirs.receivers.extend(mine.receivers)
        theirs.latched.extend(mine.latched)
        mine.receivers, mine.latched = theirs.receivers, theirs.latched

    @property
    def keys(self) -> tuple[Listeners, ...]:
        """Who hears each key."""
        return tuple(self._listeners.values())

    def go_public(self) -> None:
        """Let Zenoh carry all from now on, and keep what those who come later are to hear."""
        if not self.is_private:
            return
        self.is_private, self.is_deaf = False, True
        for listeners in self._listeners.values():
            for publisher in listeners.latched:
                publisher.put_retained()
        self.is_deaf = False
