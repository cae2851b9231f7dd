"""The key `test` of a scenario: with which seeds and values it is a test."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from twin.parameters import NotNegative
from twin.scenario.fields import faultless
from twin.strict_yaml import Fault, StrictModel

MOST = 10_000
"""Tests that one file may make."""
_ANYTHING = ["string", "number", "boolean", "array", "object", "null"]
_SEEDS_SCHEMA = {
    "anyOf": [
        {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1},
        {"type": "string"},
    ]
}


def _seeds(value: object) -> object:
    """Return the seeds of a text such as `1..10`."""
    if value == []:
        raise ValueError("must have at least one seed")
    if not isinstance(value, str):
        return tuple(value) if isinstance(value, list) else value
    ends = re.fullmatch(r"(\d{1,19})\.\.(\d{1,19})", value.strip())
    if ends is None or int(ends[1]) > int(ends[2]):
        raise ValueError("must be a list of seeds or a range such as 1..10")
    if int(ends[2]) - int(ends[1]) >= MOST:
        raise ValueError(f"must be at most {MOST} seeds, not {value}")
    return tuple(range(int(ends[1]), int(ends[2]) + 1))


def _tag(value: str) -> str:
    if not value.isidentifier() or value in ("and", "or", "not"):
        raise ValueError(f"must be a word of letters, digits and _, such as quick, not '{value}'")
    return value


Seeds = Annotated[
    tuple[Annotated[int, NotNegative], ...],
    BeforeValidator(_seeds),
    WithJsonSchema(_SEEDS_SCHEMA),
]
Values = Annotated[
    tuple[Any, ...],
    Field(min_length=1),
    WithJsonSchema({"type": "array", "minItems": 1, "items": {"type": _ANYTHING}}),
]
Tag = Annotated[str, BeforeValidator(_tag), WithJsonSchema({"type": "string"})]


class CasesConfig(StrictModel):
    """How `twin test` and pytest run the file; `twin run` runs it once, whatever stands here."""

    seeds: Seeds = ()
    """One test for each seed: a list, or a range with both ends, `1..10`; absent: the file's."""
    grid: Mapping[str, Values] = {}
    """Keys with dots, as `robots.0.pose.x`, each with a list of values: one test for each combination."""
    tags: tuple[Tag, ...] = ()
    """Words to choose tests by: `twin test -m quick`, `pytest -m quick`."""

    @property
    def count(self) -> int:
        """How many tests there are."""
        count = len(self.seeds or (0,))
        for values in self.grid.values():
            count *= len(values)
        return count

    def _faults(self) -> Iterator[Fault]:
        if "seed" in self.grid:
            yield Fault(("grid",), "test.grid has the key seed; write seeds beside grid")
        for key in self.grid:
            if key.partition(".")[0] in ("test", "name"):
                yield Fault(("grid",), f"test.grid has the key {key}, which changes no run")
        if self.count > MOST:
            yield Fault((), f"test makes {self.count} tests; at most {MOST} (`twin sweep` is for more)")

    _fits = faultless(_faults)
