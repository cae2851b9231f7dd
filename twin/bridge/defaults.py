"""Messages with ROS's default values: zero, empty, or as the definition says (a quaternion's w is 1)."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

import numpy as np
from rosbags.interfaces import Nodetype

from twin.bridge import types

M = TypeVar("M")

_STRINGS = ("string", "wstring")


def new(cls: type[M], **fields: Any) -> M:
    """Return a message with the fields given and ROS's default for all others.

    Raises:
        TypeError: a field that the message does not have.

    >>> from twin.bridge.msgs import Quaternion
    >>> new(Quaternion, z=0.5).w
    1.0
    """
    makers = _makers(cls.__msgtype__)  # type: ignore[attr-defined]
    values = {name: fields[name] if name in fields else make() for name, make in makers.items()}
    return cls(**{**values, **fields})


@cache
def _makers(msgtype: str) -> dict[str, Callable[[], Any]]:
    """Return what makes each field's default."""
    literals = types.defaults(msgtype)
    fields = types.store.get_msgdef(msgtype).fields
    return {name: _maker(description, literals.get(name)) for name, description in fields}


def _maker(description: Any, literal: str | None) -> Callable[[], Any]:
    node, value = description
    if node == Nodetype.NAME:
        cls = types.get(value)
        return lambda: new(cls)
    if node == Nodetype.BASE:
        constant = _scalar(value[0], literal)
        return lambda: constant
    (inner, element), length = value
    count = length if node == Nodetype.ARRAY else 0
    if inner == Nodetype.NAME:
        cls = types.get(element)
        return lambda: [new(cls) for _ in range(count)]
    if element[0] in _STRINGS:
        return lambda: [""] * count
    dtype = types.dtype_of(element[0])
    return lambda: np.zeros(count, dtype)


def _scalar(base: str, literal: str | None) -> Any:
    if base in _STRINGS:
        return "" if literal is None else literal.strip("'\"")
    if base == "bool":
        return literal is not None and literal.lower() in ("true", "1")
    kind = float if base.startswith("float") else int
    return kind(0) if literal is None else kind(ast.literal_eval(literal))
