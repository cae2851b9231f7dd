"""Whether a message is what would be decoded from its bytes: then nobody can tell that it never was bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from itertools import count
from struct import Struct, error
from typing import Any

import numpy as np

from twin.bridge import types
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.literals import INTEGERS, STRINGS


@cache
def exactness(typename: str) -> Callable[[Any], bool]:
    """Return a function that says whether a message is, bit for bit and type by type, what is received of it.

    Every number is a Python number of the field's range and precision, every array one of its type that
    cannot be written to. Where it would be dear to find out, such as for a NaN of float32 or a text beyond
    ASCII, the answer is no.
    """
    return _Check(typename).function()


class _Check:
    """One expression over all fields of a message: it is asked for every message of a run."""

    def __init__(self, typename: str) -> None:
        self._typename = typename
        self._known: dict[str, Any] = {"ndarray": np.ndarray, "is_text": _is_text, "are_single": _are_single}
        self._variables = (f"v{number}" for number in count())
        self._singles: list[str] = []

    def function(self) -> Callable[[Any], bool]:
        conditions = [f"type(message) is {self._name(types.get(self._typename))}"]
        conditions += self._fields(self._typename, "message")
        if self._singles:
            conditions.append(f"are_single({', '.join(self._singles)})")
        function: Callable[[Any], bool] = eval(f"lambda message: {' and '.join(conditions)}", self._known)
        return function

    def _fields(self, typename: str, message: str) -> Iterator[str]:
        for field in fields_of(typename):
            value = next(self._variables)
            # Assigned and looked at in one go; what follows may use the variable.
            yield f"type({value} := {message}.{field.attribute}) is {self._type_of(field)}"
            yield from self._field(field, value)

    def _type_of(self, field: Field) -> str:
        if field.many:
            return "list" if field.message or field.base in STRINGS else "ndarray"
        if field.message:
            return self._name(types.get(field.message))
        if field.base in STRINGS:
            return "str"
        return "bool" if field.base == "bool" else "int" if field.base in INTEGERS else "float"

    def _field(self, field: Field, value: str) -> Iterator[str]:
        if field.many in ("array", "bounded"):
            yield f"len({value}) {'==' if field.many == 'array' else '<='} {field.size}"
        if field.message:
            if field.many:
                yield f"all(map({self._name(exactness(field.message))}, {value}))"
            else:
                yield from self._fields(field.message, value)
        elif field.base in STRINGS:
            yield from self._text(field, value)
        elif field.many:
            yield f"{value}.dtype is {self._name(types.dtype_of(field.base))}"
            yield f"{value}.ndim == 1"
            flags = next(self._variables)
            yield f"not ({flags} := {value}.flags).writeable"
            yield f"{flags}.c_contiguous"
        elif field.base == "float32":
            self._singles.append(value)
        elif field.base in INTEGERS:
            low, high = (-128, 127) if field.base == "byte" else INTEGERS[field.base]
            yield f"{low} <= {value} <= {high}"

    def _text(self, field: Field, value: str) -> Iterator[str]:
        if field.many:
            yield f"all(map(is_text, {value}))"
        else:
            yield f"{value}.isascii()"
        if field.string_bound:
            lengths = f"map(len, {value})" if field.many else f"(len({value}),)"
            yield f"max({lengths}, default=0) <= {field.string_bound}"

    def _name(self, thing: Any) -> str:
        """Return a name by which the expression knows a thing."""
        name = f"k{len(self._known)}"
        self._known[name] = thing
        return name


def _is_text(value: Any) -> bool:
    return type(value) is str and value.isascii()


def _are_single(*values: float) -> bool:
    layout = _single_struct(len(values))
    try:
        return layout.unpack(layout.pack(*values)) == values
    except (OverflowError, error):
        return False


@cache
def _single_struct(values: int) -> Struct:
    return Struct(f"<{values}f")
