"""The tests that scenario files make: one for each seed and each combination of values."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any
from zlib import crc32

from twin.errors import Problem, ScenarioError, TwinError
from twin.experiments.short_names import short_names
from twin.scenario.command import twin_run
from twin.strict_yaml.document import as_text, read

_LONGEST = 40
"""Of a value in a test's name; longer ones, lists and mappings are told by their number."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One test."""

    file: Path
    name: str
    """The scenario's, with what is not the file's: `warehouse[seed=3,speed=0.2]`."""
    overrides: Mapping[str, str] = field(default_factory=dict)
    """Dotted keys -> YAML text."""
    tags: tuple[str, ...] = ()
    number: int = field(default=0, compare=False)
    """Among all that files make, from 1 on: so its folder is the same, whichever tests are chosen."""
    error: str = ""
    """Why it cannot be run: what is wrong with the key `test` of the file."""

    @property
    def scenario(self) -> str:
        """The name without what is not the file's."""
        return self.name.partition("[")[0]

    @property
    def seed(self) -> int:
        """The seed that is not the file's; 0 if it is."""
        return int(self.overrides.get("seed", "0"))

    @property
    def command(self) -> str:
        """What makes the same run alone."""
        return twin_run(self.file, self.overrides)

    @property
    def folder(self) -> str:
        """A name for the folder of its results; a long one is cut, with a checksum of the whole."""
        plain = re.sub(r"[^\w.=,+-]+", "-", self.name).strip("-")
        return plain if len(plain) <= 150 else f"{plain[:141]}-{crc32(self.name.encode()):08x}"


def cases_in(files: Iterable[Path]) -> list[Case]:
    """Return the tests of files, in their order; one with an error for a file whose tests cannot be told."""
    found: list[Case] = []
    for file in files:
        try:
            found += cases_of(file)
        except TwinError as fault:
            found.append(Case(file=file, name=file.stem, error=str(fault)))
    return [replace(case, number=number) for number, case in enumerate(found, 1)]


def cases_of(file: Path) -> list[Case]:
    """Return the tests of a file; what is wrong with a file without the key `test`, its run will tell.

    Raises:
        ScenarioError: With every problem of the file, and of the values in its grid.
    """
    data = read(file, ScenarioError).data
    said = data if isinstance(data, dict) else {}
    name = said["name"] if isinstance(said.get("name"), str) else file.stem
    if "test" not in said:
        return [Case(file=file, name=name)]
    from twin.scenario import schema

    config = schema.load(file).test
    _check(file, config.grid)
    short = short_names(list(config.grid), with_word=False)
    points = product(
        *([(key, i, value) for i, value in enumerate(values)] for key, values in config.grid.items())
    )
    seeds = config.seeds or [None]
    return [_case(file, name, seed, point, short, config.tags) for point in points for seed in seeds]


def _case(
    file: Path,
    name: str,
    seed: int | None,
    point: Sequence[tuple[str, int, Any]],
    short: Mapping[str, str],
    tags: tuple[str, ...],
) -> Case:
    own = [] if seed is None else [f"seed={seed}"]
    own += [f"{short[key]}={_named(value, i)}" for key, i, value in point]
    overrides = {} if seed is None else {"seed": str(seed)}
    overrides |= {key: as_text(_found(value, file.parent)) for key, _, value in point}
    return Case(file=file, name=f"{name}[{','.join(own)}]" if own else name, overrides=overrides, tags=tags)


def _check(file: Path, grid: Mapping[str, Sequence[Any]]) -> None:
    """Raise ScenarioError for each key or value of a grid that the file could not have."""
    from twin.scenario import schema

    problems: list[Problem] = []
    lines = read(file, ScenarioError).lines
    for key, values in grid.items():
        for value in values:
            try:
                schema.load(file, {key: as_text(_found(value, file.parent))})
            except TwinError as wrong:
                line = lines.get(("test", "grid", key))
                problems += [Problem(f"test.grid: {each.message}", file, line) for each in wrong.problems]
    if problems:
        raise ScenarioError(problems)


def _named(value: Any, index: int) -> str:
    text = re.sub(r"\s+", "", as_text(value))
    plain = isinstance(value, str | int | float | bool) and not set(text) & set("[],")
    return text if plain and len(text) <= _LONGEST else f"#{index + 1}"


def _found(value: Any, folder: Path) -> Any:
    """Return a path as seen from anywhere, if the current folder has another file of that name."""
    if isinstance(value, str) and ("/" in value or "." in value) and os.path.isfile(value):
        own = folder / value
        return os.path.abspath(own) if own.is_file() else value
    return value
