"""The first second in which two runs differ, from their hashes alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

from twin.recording.hashes import RunHashes


@dataclass(frozen=True, kw_only=True)
class Bracket:
    """Seconds, counted from 0, in which hashes first differ; None: in no second."""

    messages: int | None
    physics: int | None
    topics: tuple[str, ...]
    """Topics with types that differ in the second of `messages`; empty: only the order among them does."""

    @property
    def first(self) -> int | None:
        """The earlier of the two."""
        return min((second for second in (self.messages, self.physics) if second is not None), default=None)


def bracket(a: RunHashes, b: RunHashes) -> Bracket:
    """Return where the hashes of two runs first differ."""
    messages = _first(a.stream, b.stream)
    topics: list[str] = []
    if messages is not None:
        names = sorted({*a.topics, *b.topics})
        topics = [
            name
            for name in names
            if a.topics.get(name, {}).get(messages) != b.topics.get(name, {}).get(messages)
        ]
    return Bracket(messages=messages, physics=_first(a.physics, b.physics), topics=tuple(topics))


def _first(a: Sequence[int], b: Sequence[int]) -> int | None:
    return next((i for i, (one, other) in enumerate(zip_longest(a, b)) if one != other), None)
