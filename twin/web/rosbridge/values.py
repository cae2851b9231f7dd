"""Messages as the values of JSON or CBOR, and back; the rules are those of rosbridge_library."""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any, Literal

import numpy as np

from twin.bridge import types
from twin.bridge.messages.from_values import message_from_dict
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.literals import FLOATS, STRINGS
from twin.errors import BridgeError, nearest

Form = Literal["json", "cbor"]

_BYTES = ("uint8", "char")
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_HEADER = "std_msgs/msg/Header"
_NS = 1_000_000_000
_TYPED_ARRAYS = {
    "u2": 69, "u4": 70, "u8": 71, "i1": 72, "i2": 77, "i4": 78, "i8": 79, "f4": 85, "f8": 86,
}  # fmt: skip
"""Tags of RFC 8746 for little-endian arrays."""


def to_values(message: Any, form: Form = "json") -> dict[str, Any]:
    """Return a message as dicts, lists, numbers, texts and numpy arrays.

    `json` has arrays of uint8 as base64, other arrays for orjson's OPT_SERIALIZE_NUMPY, which writes NaN as
    null; `cbor` has them as bytes and tagged typed arrays.
    """
    return _reader(message.__msgtype__, form)(message)


@cache
def _reader(typename: str, form: Form) -> Callable[[Any], dict[str, Any]]:
    plan = [(field.name, field.attribute, _field_reader(field, form)) for field in fields_of(typename)]

    def read(message: Any) -> dict[str, Any]:
        return {
            name: getattr(message, attribute) if convert is None else convert(getattr(message, attribute))
            for name, attribute, convert in plan
        }

    return read


def _field_reader(field: Field, form: Form) -> Callable[[Any], Any] | None:
    if field.message:
        inner = _reader(field.message, form)
        return (lambda items: [inner(item) for item in items]) if field.many else inner
    if not field.many:
        return (lambda value: int(value) & 255) if field.base in ("byte", "octet") else None
    if field.base in STRINGS:
        return list
    if field.base in ("byte", "octet"):
        return lambda array: np.asarray(array, np.int8).view(np.uint8).tolist()
    if field.base in _BYTES:
        return _bytes if form == "cbor" else _base64
    if form == "cbor":
        return _tagged
    return partial(np.ascontiguousarray, dtype=types.dtype_of(field.base))


def _bytes(array: Any) -> bytes:
    return np.asarray(array, np.uint8).tobytes()


def _base64(array: Any) -> str:
    return base64.b64encode(_bytes(array)).decode()


def _tagged(array: Any) -> Any:
    array = np.asarray(array)
    tag = _TYPED_ARRAYS.get(array.dtype.str[1:])
    if tag is None:
        return array.tolist()
    from cbor2 import CBORTag

    return CBORTag(tag, np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes())


def to_message(cls: type[Any], values: Any, now_ns: int, *, is_finite: bool = False) -> Any:
    """Return a message of the values given and ROS's defaults for all others.

    Args:
        cls: The message's class.
        values: A mapping as JSON has it: null is NaN where a number belongs and nothing elsewhere, bytes may
            be base64, times may be spelled secs and nsecs.
        now_ns: What a header without a stamp, or with zero, is stamped with [ns].
        is_finite: Whether NaN and infinity are refused.

    Raises:
        BridgeError: an unknown field, or a value that its field cannot hold; names the field.
    """
    msgtype: str = cls.__msgtype__
    prepared = _prepared(msgtype, {} if values is None else values, msgtype, now_ns, is_finite)
    return message_from_dict(cls, prepared)


def _prepared(typename: str, values: Any, path: str, now_ns: int, is_finite: bool) -> dict[str, Any]:
    if not isinstance(values, Mapping):
        raise BridgeError(f"{path} is a {typename}, which is an object; not {_shown(values)}")
    if typename in _TIMES:
        values = {{"secs": "sec", "nsecs": "nanosec"}.get(name, name): it for name, it in values.items()}
    fields = {field.name: field for field in fields_of(typename)}
    made: dict[str, Any] = {}
    if typename == _HEADER:  # clients for ROS 1 count their messages
        values = {name: it for name, it in values.items() if name != "seq"}
    for name, value in values.items():
        field = fields.get(name)
        if field is None:
            raise BridgeError(f"{path} has no field {str(name)[:80]!r}; {nearest(str(name)[:80], fields)}")
        if value is None and (field.many or field.base not in FLOATS):
            continue
        made[name] = _value(field, value, f"{path}.{name}", now_ns, is_finite)
    if typename == _HEADER and not any(made.get("stamp", {}).values()):
        made["stamp"] = {"sec": now_ns // _NS, "nanosec": now_ns % _NS}
    return made


def _value(field: Field, value: Any, path: str, now_ns: int, is_finite: bool) -> Any:
    if not field.many:
        return _item(field, value, path, now_ns, is_finite)
    if isinstance(value, (str, bytes)) and field.base in (*_BYTES, "byte", "octet"):
        return _from_base64(field, value, path)
    if not isinstance(value, list):
        raise BridgeError(f"{path} is a {field.typename}, which is a list; not {_shown(value)}")
    return [_item(field, item, path, now_ns, is_finite) for item in value]


def _from_base64(field: Field, value: str | bytes, path: str) -> Any:
    try:
        data = value if isinstance(value, bytes) else base64.b64decode(value, validate=True)
    except (binascii.Error, ValueError):
        raise BridgeError(f"{path} is a {field.typename} as base64; not {_shown(value)}") from None
    return np.frombuffer(data, types.dtype_of(field.base))


def _item(field: Field, value: Any, path: str, now_ns: int, is_finite: bool) -> Any:
    if field.message:
        return _prepared(field.message, value, path, now_ns, is_finite)
    if (field.base in STRINGS) is not isinstance(value, str):
        raise BridgeError(f"{path} is a {field.base}; not {_shown(value)}")
    if field.base in FLOATS:
        value = math.nan if value is None else value
        if is_finite and isinstance(value, (int, float)) and not math.isfinite(value):
            raise BridgeError(f"{path} is not a finite number, and nothing moves by that")
    return value


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
