"""Messages with ROS's default values: zero, empty, or as the definition says (a quaternion's w is 1)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys.base import normalize_fieldname

from twin.bridge import types
from twin.bridge.types.literals import STRINGS, Value

M = TypeVar("M")


def new(cls: type[M], **fields: Any) -> M:
    """Return a message with the fields given and ROS's default for all others.

    Raises:
        TypeError: a field that the message does not have.

    >>> from twin.bridge.msgs import Quaternion
    >>> new(Quaternion, z=0.5).w
    1.0
    """
    constants, makers = _defaults(cls.__msgtype__)  # type: ignore[attr-defined]
    made = {name: make() for name, make in makers.items() if name not in fields}
    return cls(**{**constants, **made, **fields})


@cache
def _defaults(msgtype: str) -> tuple[dict[str, Value], dict[str, Callable[[], Any]]]:
    """Return the defaults that nobody can change, and what makes each other field's."""
    values = types.defaults(msgtype)
    constants: dict[str, Value] = {}
    makers: dict[str, Callable[[], Any]] = {}
    for name, description in types.store.fielddefs[msgtype][1]:
        field, default = normalize_fieldname(name), values.get(name)
        node, value = cast("tuple[Nodetype, Any]", description)
        if node == Nodetype.BASE:
            constants[field] = _ZEROS.get(value[0], 0) if default is None else _signed(value[0], default)
        else:
            makers[field] = _maker(description, default)
    return constants, makers


def _maker(description: Any, default: Value | None) -> Callable[[], Any]:
    node, value = description
    if node == Nodetype.NAME:
        cls = types.get(value)
        return lambda: new(cls)
    (inner, element), length = value
    count = length if node == Nodetype.ARRAY else 0
    if inner == Nodetype.NAME:
        cls = types.get(element)
        return lambda: [new(cls) for _ in range(count)]
    if element[0] in STRINGS:
        texts = [""] * count if default is None else default
        return lambda: list(texts)  # type: ignore[arg-type]
    dtype = types.dtype_of(element[0])
    numbers = np.zeros(count, dtype) if default is None else np.array(_signed(element[0], default), dtype)
    return lambda: numbers.copy()


def _signed(base: str, value: Any) -> Any:
    """Return a value as rosbags has it, for which a byte is a signed number."""
    if base != "byte":
        return value
    return [_signed(base, item) for item in value] if isinstance(value, list) else (value + 128) % 256 - 128


_ZEROS: dict[str, Value] = {"string": "", "wstring": "", "bool": False, "float32": 0.0, "float64": 0.0}
