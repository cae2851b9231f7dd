"""Messages from plain values: what `ros2 topic pub`, service calls and goals are given as YAML.

The rules are those of rosidl_runtime_py (set_message.py), but a number that does not fit, a fraction for
an integer or a word for a bool is an error rather than a silent change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.literals import FLOATS, INTEGERS, STRINGS
from twin.errors import BridgeError, nearest

M = TypeVar("M")

_NS = 1_000_000_000
_HEADER, _TIME = "std_msgs/msg/Header", "builtin_interfaces/msg/Time"


def message_from_dict(cls: type[M], values: Mapping[str, Any] | None, *, now_ns: int | None = None) -> M:
    """Return a message with the values given, at any depth, and ROS's defaults for all others.

    Args:
        cls: the message's class.
        values: field -> number, text, list, dict or message; None is the same as {}.
        now_ns: [ns]; what a header given as 'auto' and a time given as 'now' are stamped with; without it
            those words are errors.

    Raises:
        BridgeError: an unknown field, or a value that its field cannot hold; names the field.
    """
    return _message(cls, {} if values is None else values, "", now_ns)


def checked(message: M) -> M:
    """Return a copy of a message whose fields have the types that they are encoded from.

    A list where an array of numbers belongs becomes an array; every number is compared with its range.

    Raises:
        BridgeError: a value that its field cannot hold; names the field.
    """
    try:
        return _message(type(message), _shallow(message), "", None, deep=True)
    except BridgeError as fault:
        raise BridgeError(f"a {message.__msgtype__} cannot be encoded: {fault}") from fault  # type: ignore[attr-defined]


def _shallow(message: Any) -> dict[str, Any]:
    fields = fields_of(message.__msgtype__)
    return {field.name: getattr(message, field.attribute, None) for field in fields}


def _message(cls: type[M], values: Any, path: str, now_ns: int | None, *, deep: bool = False) -> M:
    msgtype: str = cls.__msgtype__  # type: ignore[attr-defined]
    if isinstance(values, cls):
        if not deep:
            return values
        values = _shallow(values)
    if now_ns is not None and (msgtype, values) in ((_HEADER, "auto"), (_TIME, "now")):
        time = types.get(_TIME)(now_ns // _NS, now_ns % _NS)
        return time if msgtype == _TIME else new(cls, stamp=time)
    fields = {field.name: field for field in fields_of(msgtype)}
    if not isinstance(values, Mapping):
        raise _wrong(path, msgtype, values, f"a mapping with fields of {', '.join(fields) or 'none'}")
    given = {}
    for name, value in values.items():
        inner = f"{path}.{name}" if path else str(name)
        if name not in fields:
            raise BridgeError(f"{msgtype} has no field {inner!r}; {nearest(str(name), fields)}")
        given[fields[name].attribute] = _value(fields[name], value, inner, now_ns, deep)
    return new(cls, **given)


def _value(field: Field, value: Any, path: str, now_ns: int | None, deep: bool) -> Any:
    if not field.many:
        return _item(field, value, path, now_ns, deep)
    if isinstance(value, (str, Mapping)) or not hasattr(value, "__len__"):
        raise _wrong(path, field.typename, value, "a list")
    if field.many == "array" and len(value) != field.size:
        raise BridgeError(f"{path} has {len(value)} elements; valid: exactly {field.size}")
    if field.many == "bounded" and len(value) > field.size:
        raise BridgeError(f"{path} has {len(value)} elements; valid: at most {field.size}")
    if isinstance(value, np.ndarray) and not field.message and value.dtype == types.dtype_of(field.base):
        return np.ascontiguousarray(value)
    items = [_item(field, item, f"{path}[{i}]", now_ns, deep) for i, item in enumerate(value)]
    if field.message or field.base in STRINGS:
        return items
    return np.array(items, types.dtype_of(field.base))


def _item(field: Field, value: Any, path: str, now_ns: int | None, deep: bool) -> Any:
    if field.message:
        return _message(types.get(field.message), value, path, now_ns, deep=deep)
    if isinstance(value, np.generic):
        value = value.item()
    if field.base in STRINGS:
        # As set_message does: a YAML reader takes `data: 5` for a number.
        return _text(field, value if deep or not isinstance(value, (int, float)) else str(value), path)
    if field.base == "bool":
        if isinstance(value, bool) or (isinstance(value, int) and value in (0, 1)):
            return bool(value)
        raise _wrong(path, field.base, value, "true or false")
    if field.base in INTEGERS:
        number = _integer(field.base, value, path)
        # rosbags has a byte as a signed number, though ROS's is not.
        return number - 256 if field.base == "byte" and number > 127 else number
    return _float(field.base, value, path)


def _text(field: Field, value: Any, path: str) -> str:
    if not isinstance(value, str):
        raise _wrong(path, field.base, value, "a text")
    if any("\ud800" <= character <= "\udfff" for character in value):
        raise _wrong(path, field.base, value, "a text without halves of surrogate pairs")
    if field.string_bound and len(value) > field.string_bound:
        raise BridgeError(f"{path} has {len(value)} characters; valid: at most {field.string_bound}")
    return value


def _integer(base: str, value: Any, path: str) -> int:
    low, high = (-128, 255) if base == "byte" else INTEGERS[base]
    valid = f"a whole number from {low} to {high}"
    if base in ("byte", "octet") and isinstance(value, (str, bytes)) and len(value) == 1:
        value = ord(value)
    if isinstance(value, str):
        try:
            value = int(value)
        except ValueError:
            raise _wrong(path, base, value, valid) from None
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or not low <= value <= high:
        raise _wrong(path, base, value, valid)
    return int(value)


def _float(base: str, value: Any, path: str) -> float:
    if isinstance(value, str):
        try:
            value = float(value)  # YAML 1.1 takes 1e-3 for a text
        except ValueError:
            raise _wrong(path, base, value, "a number") from None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _wrong(path, base, value, "a number")
    try:
        number = float(value)
    except OverflowError:
        raise _wrong(path, base, value, "a smaller number") from None
    if math.isfinite(number) and abs(number) > FLOATS[base]:
        raise _wrong(path, base, value, f"a number up to {FLOATS[base]:.3g}")
    return number


def _wrong(path: str, typename: str, value: Any, valid: str) -> BridgeError:
    shown = repr(value)
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    where = f"{path} is a {typename}" if path else f"a {typename}"
    return BridgeError(f"{where} and cannot be {shown}; valid: {valid}")
