"""The numbers of a reading: of a ROS message, or of what measures joints."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from twin.geometry import Array


def values_of(thing: Any) -> Mapping[str, Any]:
    """Return the fields of a reading by name, but for its header and its type."""
    if hasattr(thing, "_asdict"):
        return dict(thing._asdict())
    fields = (field.name for field in dataclasses.fields(thing))
    return {name: getattr(thing, name) for name in fields if name not in ("header", "__msgtype__")}


def numbers(thing: Any) -> list[str]:
    """Return what holds floating-point numbers only in a reading: `ranges`, `angular_velocity.x`."""
    return [path for path, is_number in _paths(thing, "") if is_number]


def _paths(thing: Any, prefix: str) -> Iterator[tuple[str, bool]]:
    for name, value in values_of(thing).items():
        path = f"{prefix}{name}"
        if isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
            yield path, True
        elif dataclasses.is_dataclass(value):
            parts = list(_paths(value, f"{path}."))
            yield path, bool(parts) and all(is_number for _, is_number in parts)
            yield from parts


def altered(reading: Any, path: str, change: Callable[[Array], Array]) -> Any:
    """Return a copy of a reading in which `change` was done to the numbers at `path`, of shape (n,)."""
    head, _, rest = path.partition(".")
    value = getattr(reading, head)
    if rest:
        return with_field(reading, head, altered(value, rest, change))
    if isinstance(value, float):
        return with_field(reading, head, float(change(np.array([value]))[0]))
    if isinstance(value, np.ndarray):
        made = change(value).astype(value.dtype, copy=False)
        made.setflags(write=False)
        return with_field(reading, head, made)
    parts = values_of(value)
    made = change(np.array(list(parts.values())))
    return with_field(
        reading, head, dataclasses.replace(value, **dict(zip(parts, made.tolist(), strict=True)))
    )


def with_field(thing: Any, name: str, value: Any) -> Any:
    """Return a copy with another value of one field."""
    return (
        thing._replace(**{name: value})
        if hasattr(thing, "_replace")
        else dataclasses.replace(thing, **{name: value})
    )


def is_same(one: Any, other: Any) -> bool:
    """Whether two readings say the same, whenever they do."""
    if isinstance(one, np.ndarray):
        return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))
    if dataclasses.is_dataclass(one) or hasattr(one, "_asdict"):
        theirs = values_of(other)
        return all(is_same(value, theirs[name]) for name, value in values_of(one).items())
    return bool(one == other)
