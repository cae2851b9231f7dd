"""Messages on one line, as `ros2 service call` prints them: `std_msgs.msg.String(data='')`."""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.bridge.types.fields import Field, fields_of


def message_repr(message: Any) -> str:
    """Return a message as Python's repr of rclpy's message classes (rosidl_generator_py, _msg.py.em).

    >>> from twin.bridge.msgs import String
    >>> message_repr(String("Hello"))
    "std_msgs.msg.String(data='Hello')"
    """
    typename: str = message.__msgtype__
    fields = [
        f"{field.name}={_field(getattr(message, field.attribute), field)}" for field in fields_of(typename)
    ]
    return f"{typename.replace('/', '.')}({', '.join(fields)})"


def _field(value: Any, field: Field) -> str:
    if not field.many:
        return _item(value, field)
    if (
        field.many == "array"
        and isinstance(value, np.ndarray)
        and field.base not in ("bool", "byte", "octet")
    ):
        return repr(value)  # arrays of fixed length are numpy's in rclpy too
    return f"[{', '.join(_item(item, field) for item in value)}]"


def _item(value: Any, field: Field) -> str:
    if field.message:
        return message_repr(value)
    if field.base in ("byte", "octet"):
        return repr(bytes([int(value) & 255]))
    return repr(value.item() if isinstance(value, np.generic) else value)
