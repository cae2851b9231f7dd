"""The fields in which two messages differ, bit by bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from twin.bridge import types
from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.types.fields import Field, fields_of
from twin.experiments.diff.difference import Value


def differences(typename: str, a: bytes, b: bytes) -> Iterator[tuple[str, Value, Value]]:
    """Yield the path of each field or element that differs, such as `ranges[17]`, and both values.

    Args:
        typename: package/msg/Name of both messages.
        a: Payload of the first, CDR.
        b: Of the second.
    """
    coder: Codec[Any] = codec(types.get(typename))
    yield from _messages("", typename, coder.decode(a), coder.decode(b))


def _messages(path: str, typename: str, a: Any, b: Any) -> Iterator[tuple[str, Value, Value]]:
    for field in fields_of(typename):
        inside = f"{path}.{field.name}" if path else field.name
        yield from _values(inside, field, getattr(a, field.attribute), getattr(b, field.attribute))


def _values(path: str, field: Field, a: Any, b: Any) -> Iterator[tuple[str, Value, Value]]:
    if not field.many:
        yield from _items(path, field, a, b)
        return
    if len(a) != len(b):
        yield f"{path}.length", len(a), len(b)
        return
    if isinstance(a, np.ndarray):
        same = np.asarray(a).view(f"u{a.itemsize}") == np.asarray(b).view(f"u{a.itemsize}")
        for index in np.flatnonzero(~same).tolist():
            yield f"{path}[{index}]", a[index].item(), b[index].item()
        return
    for index, (one, other) in enumerate(zip(a, b, strict=True)):
        yield from _items(f"{path}[{index}]", field, one, other)


def _items(path: str, field: Field, a: Any, b: Any) -> Iterator[tuple[str, Value, Value]]:
    if field.message:
        yield from _messages(path, field.message, a, b)
    elif repr(a) != repr(b):  # which tells -0.0 from 0.0, and not NaN from NaN
        yield path, a, b
