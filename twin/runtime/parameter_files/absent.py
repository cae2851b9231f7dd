"""Parameters of a ROS node that the node here lacks: which of them a run would miss."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Absent:
    """Names by what leaving them unread means; all of them are names, not typing mistakes."""

    idle: frozenset[str] = frozenset()
    """Whatever their value, nothing here would change by it."""
    harmless: Mapping[str, Any] = field(default_factory=dict)
    """With these values theirs does what the node here does anyway."""
    missed: frozenset[str] = frozenset()
    """Theirs does something that the node here cannot."""

    def __contains__(self, name: str) -> bool:
        """Whether the ROS node has a parameter of this name, without its section."""
        return name in self.idle or name in self.harmless or name in self.missed

    def makes_no_difference(self, name: str, value: Any) -> bool:
        """Whether a run is the same without it."""
        return name in self.idle or (name in self.harmless and bool(value == self.harmless[name]))
