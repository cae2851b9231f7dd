"""What a scenario's file says, as plain data: kept, changed and read again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from twin.errors import Problem
from twin.files.kept import hash_of
from twin.strict_yaml import Document, Loc


@dataclass(frozen=True)
class Source:
    """The data of a file with the overrides in it; two scenarios may be equal though theirs differ."""

    file: Path = field(compare=False)
    """Absolute path; files that the data names are relative to its folder."""
    data: Mapping[str, Any] = field(compare=False)
    """Strings, numbers, lists and mappings as in YAML. Nobody changes them."""
    document: Document | None = field(default=None, compare=False, repr=False)
    """Where in the file it stands."""

    def with_params_file(self, path: str, navigates: Sequence[bool]) -> Source:
        """Return the same with a Nav2 parameter file for those robots that navigate."""
        data = deepcopy(dict(self.data))
        for robot, chosen in zip(data.get("robots", ()), navigates, strict=False):
            if chosen:
                robot["navigation"] = {**(robot["navigation"] or {}), "params_file": path}
        return Source(self.file, data, self.document)

    def problem(self, loc: Loc, message: str) -> Problem:
        """Return what is wrong with a value that was valid by itself, at its line if that is known."""
        return Problem(message) if self.document is None else self.document.problem(loc, message)

    def files(self) -> dict[str, str]:
        """Return the files that the data names, as it names them, and the SHA-256 of each."""
        named = {text.rpartition(":")[0] if ".py:" in text else text for text in _texts(self.data)}
        paths = sorted(text for text in named if "." in text or "/" in text)
        found = {text: hash_of(self.file.parent / text) for text in paths}
        return {text: content for text, content in found.items() if content is not None}


NOWHERE = Source(Path(), {})
"""Of a scenario that was not read from a file."""


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping):
        for key, value in data.items():
            yield from _texts(key)
            yield from _texts(value)
    elif isinstance(data, list):
        for value in data:
            yield from _texts(value)
