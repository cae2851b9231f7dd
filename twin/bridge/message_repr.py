"""Messages as rclpy's `repr` shows them: `std_msgs.msg.String(data='Hello')`.

The forms are those of rosidl_generator_py's classes; `ros2 topic pub` and `ros2 service call` print them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.bridge.type_fields import Field, fields_of

_TYPECODES = {
    "char": "B",
    "float32": "f",
    "float64": "d",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
}
"""Of Python's arrays, in which rclpy keeps sequences of numbers."""


def message_repr(message: Any) -> str:
    """Return a message as rclpy's `repr` of it."""
    package, kind, name = message.__msgtype__.split("/")
    fields = (
        f"{field.name}={_field_repr(getattr(message, field.attribute), field)}"
        for field in fields_of(message.__msgtype__)
    )
    return f"{package}.{kind}.{name}({', '.join(fields)})"


def value_repr(value: Any, field: Field) -> str:
    """Return a field's value as `print` shows it in rclpy: an array('f', [0.5]), a number, a text."""
    if isinstance(value, str):
        return value
    if field.many in ("sequence", "bounded") and field.base in _TYPECODES:
        return repr(_array(value, field))
    if field.many == "array" and isinstance(value, np.ndarray) and field.base in _TYPECODES:
        return str(value)
    return _field_repr(value, field)


def _field_repr(value: Any, field: Field) -> str:
    if not field.many:
        return _item_repr(value, field)
    if field.base in _TYPECODES and field.many != "array":
        return repr(value.tolist() if field.base != "float32" else _array(value, field).tolist())
    if field.base in _TYPECODES:
        return repr(value)  # a numpy array in rclpy too
    return f"[{', '.join(_item_repr(item, field) for item in value)}]"


def _item_repr(value: Any, field: Field) -> str:
    if field.message:
        return message_repr(value)
    if field.base in ("byte", "octet"):
        return repr(bytes([int(value) & 255]))
    return repr(value.item() if isinstance(value, np.generic) else value)


def _array(value: Any, field: Field) -> Any:
    from array import array

    return array(_TYPECODES[field.base], np.asarray(value).tolist())
