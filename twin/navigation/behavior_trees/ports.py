"""Ports of tree nodes: their types, and how XML text becomes a value (BehaviorTree.CPP, basic_types)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Port:
    """An input or output of a node."""

    name: str
    type: str = "string"
    """A key of `READERS`, or `message` for what only the blackboard can hold."""
    default: Any = None
    """None: the port may be left out and is then empty."""
    is_output: bool = False
    required: bool = False


def inputs(**types: str | tuple[str, Any]) -> tuple[Port, ...]:
    """Return input ports: `name="double"`, or `name=("double", 1.0)` with a default."""
    return tuple(
        Port(name, *((spec,) if isinstance(spec, str) else spec)) for name, spec in sorted(types.items())
    )


def outputs(**types: str) -> tuple[Port, ...]:
    """Return output ports."""
    return tuple(Port(name, type_, is_output=True) for name, type_ in sorted(types.items()))


def read_value(text: str, type_: str) -> Any:
    """Return the value of a literal.

    Raises:
        ValueError: no literal of this type; the message says what would be one.
    """
    if type_ == "message":
        raise ValueError("must be a blackboard entry such as {goal}")
    try:
        return READERS[type_](text)
    except ValueError:
        raise ValueError(f"must be {_MEANT[type_]} or a blackboard entry in braces") from None


def is_pointer(text: str) -> bool:
    """Return whether a port's text names a blackboard entry: `{entry}`."""
    return len(text) >= 3 and text[0] == "{" and text[-1] == "}"


def _reader(read: Callable[[str], Any], is_valid: Callable[[Any], bool]) -> Callable[[str], Any]:
    def checked(text: str) -> Any:
        value = read(text)
        if not is_valid(value):
            raise ValueError
        return value

    return checked


_BOOLS = dict.fromkeys(("1", "true", "TRUE", "True"), True)
_BOOLS |= dict.fromkeys(("0", "false", "FALSE", "False"), False)

READERS: dict[str, Callable[[str], Any]] = {
    "string": str,
    "double": _reader(float, math.isfinite),
    "seconds": _reader(float, math.isfinite),
    "limit": _reader(float, lambda value: not math.isnan(value)),
    "int": int,
    "unsigned": _reader(int, lambda value: value >= 0),
    "bool": _reader(_BOOLS.get, lambda value: value is not None),
    "strings": lambda text: text.split(";") if text else [],
    "ints": lambda text: [int(part) for part in text.split(";")],
    "any": str,
}
_MEANT = {
    "double": "a number that is finite",
    "seconds": "a number that is finite",
    "limit": "a number, or inf for no limit",
    "int": "a whole number",
    "unsigned": "a whole number that is not negative",
    "bool": "true or false",
    "ints": "whole numbers separated by semicolons",
}
