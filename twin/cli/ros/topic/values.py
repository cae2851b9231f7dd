"""One field of a message as `ros2 topic echo --field` prints it."""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.bridge.types.fields import Field

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


def value_text(value: Any, field: Field) -> str:
    """Return a field's value as `print` shows it in rclpy: 0.5, Hello, array('f', [0.5]), [0. 0.]."""
    import numpy as np

    from twin.bridge.messages.as_text import message_repr

    if field.many == "array" and isinstance(value, np.ndarray):
        return str(value)
    if field.many and field.base in _TYPECODES:
        return repr(array(_TYPECODES[field.base], np.asarray(value).tolist()))
    if field.many:
        items = [message_repr(item) if field.message else repr(_plain(item, field)) for item in value]
        return f"[{', '.join(items)}]"
    return str(_plain(value, field))


def _plain(value: Any, field: Field) -> Any:
    if field.base in ("byte", "octet"):
        return bytes([int(value) & 255])
    return value.item() if hasattr(value, "item") else value
