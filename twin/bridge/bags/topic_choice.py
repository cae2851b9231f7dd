"""Which topics are meant: by name, by regular expression, or all."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field

from twin.errors import RecordingError, nearest


@dataclass(frozen=True, kw_only=True)
class TopicChoice:
    """Names and regular expressions, which must match a whole name; nothing given is everything."""

    topics: tuple[str, ...] = ()
    regex: str = ""
    exclude: str = ""
    """Regular expression of names to leave out."""
    _patterns: tuple[re.Pattern[str], re.Pattern[str]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Raise RecordingError for what is no regular expression."""
        object.__setattr__(self, "_patterns", (_pattern(self.regex), _pattern(self.exclude)))

    def __contains__(self, name: str) -> bool:
        included, excluded = self._patterns
        wanted = name in self.topics or bool(self.regex and included.fullmatch(name))
        everything = not self.topics and not self.regex
        return (wanted or everything) and not (self.exclude and excluded.fullmatch(name))

    def of(self, names: Collection[str]) -> tuple[str, ...]:
        """Return those of the names that are meant, sorted.

        Raises:
            RecordingError: a topic is not among the names.
        """
        unknown = sorted(set(self.topics) - set(names))
        if unknown:
            raise RecordingError(f"there is no topic {unknown[0]}; {nearest(unknown[0], names)}")
        return tuple(sorted(name for name in names if name in self))


def _pattern(text: str) -> re.Pattern[str]:
    try:
        return re.compile(text)
    except re.error as fault:
        raise RecordingError(f"{text!r} is not a regular expression: {fault}") from fault
