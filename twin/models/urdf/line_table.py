"""Which line of which file each element of a robot's text was written in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from twin.errors import SourceLine


@dataclass(frozen=True, kw_only=True)
class LineTable:
    """The places of all elements of a text that xacro put together of several files."""

    files: tuple[Path, ...]
    """Each file once."""
    places: tuple[tuple[int, int], ...]
    """Index into `files` and 1-based line of every element, in the order of their start tags."""

    def lines(self) -> list[SourceLine]:
        """Return the place of every element, in the order of their start tags."""
        return [SourceLine(line, self.files[file]) for file, line in self.places]
