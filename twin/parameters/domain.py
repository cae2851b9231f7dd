"""Which values a parameter takes, and the one sentence that refuses others."""

from __future__ import annotations

import math
import types
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from annotated_types import Len

from twin.parameters.bounds import LARGEST, SMALLEST, Bounds
from twin.parameters.forms import Form, MayBeInfinite
from twin.parameters.units import Unit

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

_OPEN = Bounds()
_MEANT = {bool: "true or false", int: "a whole number", float: "a number", str: "text", tuple: "a list"}


@dataclass(frozen=True)
class Domain:
    """Type, bounds, size and choices of a value, as it is told: a period in nanoseconds as a frequency."""

    kind: type
    """bool, int, float, str; for lists tuple, or a named one."""
    unit: Unit | None = None
    bounds: Bounds = _OPEN
    choices: tuple[Any, ...] = ()
    """The only valid values, if there are any."""
    item: Domain | None = None
    """Of a list: what all its items are."""
    lengths: tuple[int, int | None] = (0, None)
    """Of a list: how many they are at least and at most; None: as many as you like."""
    is_fixed: bool = False
    """Of a list: whether each of its items has a place of its own, as x and y have."""
    is_optional: bool = False
    """Whether None is valid, too."""
    may_be_infinite: bool = False
    metadata: tuple[Any, ...] = ()
    """The annotation's own, for who understands more of it."""

    @property
    def sizes(self) -> tuple[float, float]:
        """Smallest and largest size of a number that is not 0."""
        return (SMALLEST, LARGEST) if self.unit is None else self.unit.sizes

    @cached_property
    def said(self) -> str:
        """What is valid, as the rest of a sentence; '' where type and size tell it."""
        if self.choices:
            return f"must be {' or '.join(map(repr, self.choices))}"
        if self.item is not None:
            return f"each {self.item.said}" if self.item.said else ""
        return f"must be {self.bounds.said}" if self.bounds.said else ""

    @property
    def annotation(self) -> Any:
        """The type of the told value with its metadata, for a schema."""
        if self.item is not None:
            inner = _annotated(self.item.annotation, [self.item])
            listed = (inner,) * self.lengths[0] if self.is_fixed else (inner, ...)
            return _annotated(tuple.__class_getitem__(listed), self.metadata)
        kind = Literal[self.choices] if self.choices else self.kind
        others = [one for one in self.metadata if not isinstance(one, Form | Unit)]
        return _annotated(kind, [*others, *([self.unit] if self.unit is not None else [])])

    def checked(self, value: Any) -> Any:
        """Return a value as the config has it: a whole number as a double, a list as a tuple.

        Raises:
            ValueError: It is none; says what is valid, as the rest of a sentence.
        """
        if value is None and self.is_optional:
            return None
        if self.item is not None:
            return self._checked_list(value)
        try:
            return self._sound(value)
        except ValueError as error:
            raise ValueError(f"{error}, not {value!r}") from None

    def parsed(self, value: Any) -> Any:
        """Return what a file may have: as `checked`, and text with a unit; lists are left to their items.

        Raises:
            ValueError: It is none; says only what is valid.
        """
        if self.choices or value is None:
            return value
        if self.item is not None:
            return tuple(value) if isinstance(value, list) else value  # what a strict schema asks for
        if self.unit is not None:
            if isinstance(value, str):
                value = self.unit.parse(value)
            elif type(value) not in (int, float):
                return value  # the unit says what is valid
        return self._sound(value)

    def _checked_list(self, value: Any) -> tuple[Any, ...]:
        assert self.item is not None
        if not isinstance(value, list | tuple):
            raise ValueError(f"must be {_MEANT[tuple]}, not {value!r}")
        low, high = self.lengths
        if not low <= len(value) <= (len(value) if high is None else high):
            many = low if low == high else f"at least {low}" if len(value) < low else f"at most {high}"
            raise ValueError(f"must have {many} values, not {len(value)}")
        items = [self.item.checked(one) for one in value]
        return tuple(items) if self.kind is tuple else self.kind(*items)

    def _sound(self, value: Any) -> Any:
        if self.kind is float and type(value) is int:
            value = float(value)
        if type(value) is not self.kind:
            raise ValueError(f"must be {_MEANT[self.kind]}")
        if self.choices and value not in self.choices:
            raise ValueError(self.said)
        if isinstance(value, int | float) and self.kind is not bool:
            self._check_size(value)
        return value

    def _check_size(self, value: float) -> None:
        if not math.isfinite(value) and not (math.isinf(value) and self.may_be_infinite):
            raise ValueError(f"{self.said} and finite" if self.said else "must be finite")
        if not self.bounds.hold(value):
            raise ValueError(self.said)
        if self.kind is int or math.isinf(value) or value == 0.0:
            return
        low, high = self.sizes
        if not low <= abs(value) <= high:
            unit = "" if self.unit is None else f" {self.unit.si}"
            raise ValueError(f"must be 0, or from {low:g} to {high:g}{unit} in size")

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema  # only where schemas are made: the pure packages stay light

        # Asked first, it refuses in its own words; the rest makes the JSON schema.
        return core_schema.no_info_before_validator_function(self.parsed, handler(source))


def domain_of(hint: Any) -> Domain | None:
    """Return which values a type hint takes; None for what is no parameter, such as a config or an array."""
    kind, found, is_optional = _taken_apart(hint)
    form = next((one for one in found if isinstance(one, Form)), None)
    unit = form.unit if form is not None else next((one for one in found if isinstance(one, Unit)), None)
    common: Mapping[str, Any] = {"is_optional": is_optional, "metadata": tuple(found)}
    if get_origin(kind) is Literal:
        choices = get_args(kind)
        return Domain(type(choices[0]), choices=choices, **common)
    if get_origin(kind) is tuple:
        first, *others = get_args(kind)
        item, several = domain_of(first), next((one for one in found if isinstance(one, Len)), Len())
        is_fixed = others != [...]
        lengths = (1 + len(others),) * 2 if is_fixed else (several.min_length, several.max_length)
        return item and Domain(tuple, item=item, lengths=lengths, is_fixed=is_fixed, **common)
    if isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields"):
        item = domain_of(next(iter(get_type_hints(kind, include_extras=True).values()), None))
        return item and Domain(kind, item=item, lengths=(len(kind._fields),) * 2, is_fixed=True, **common)
    if kind not in (bool, int, float, str):
        return None
    return Domain(
        float if form is not None else kind,
        unit=unit,
        bounds=Bounds.of(found),
        may_be_infinite=MayBeInfinite in found,
        **common,
    )


def metadata_of(hint: Any) -> tuple[object, ...]:
    """Return what a type hint is annotated with, also inside an optional one."""
    return tuple(_taken_apart(hint)[1])


def _taken_apart(hint: Any) -> tuple[Any, list[object], bool]:
    """Return a hint's type, its metadata from the inside out, and whether it may be None."""
    if get_origin(hint) is Annotated:
        inner, *metadata = get_args(hint)
        kind, found, is_optional = _taken_apart(inner)
        for one in metadata:  # `Annotated[float, Metres]` is meant as `Metres`
            found += _taken_apart(one)[1] if get_origin(one) is Annotated else [one]
        return kind, found, is_optional
    if get_origin(hint) in (Union, types.UnionType):
        others = [one for one in get_args(hint) if one is not type(None)]
        if len(others) == 1:
            kind, found, _ = _taken_apart(others[0])
            return kind, found, True
    return hint, [], False


def _annotated(kind: Any, metadata: Iterable[object]) -> Any:
    for one in metadata:
        kind = Annotated[kind, one]
    return kind
