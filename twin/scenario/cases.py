"""The key `test` of a scenario: with which seeds and values it is a test."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from twin.parameters import NotNegative
from twin.scenario.fields import faultless
from twin.scenario.seeds import parse_seeds
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
    if value == []:
        raise ValueError("must have at least one seed")
    if not isinstance(value, str):
        return tuple(value) if isinstance(value, list) else value
    return parse_seeds(value, MOST)


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
    """One test for each seed: a list, or a range, `1..10` or `0:10` (without 10); absent: the file's."""
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
