"""Messages as text: YAML, comma-separated values and plain dicts of `ros2 topic echo`, and one line.

One line is as of `ros2 service call`: `std_msgs.msg.String(data='')`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
import yaml

from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.bridge.types.fields import Field, fields_of

_IDL_NAMES = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double"}
_PROTOTYPES = {"msg": "", "srv": "_Request", "action": "_Goal"}


def message_to_dict(
    message: Any, *, truncate_length: int | None = None, no_arr: bool = False, no_str: bool = False
) -> dict[str, Any]:
    """Return a message as dicts, lists, numbers and strings.

    Args:
        message: of any type.
        truncate_length: cut sequences and strings to so many elements and add '...'; None for no cut.
        no_arr: say only type and length of sequences.
        no_str: say only the length of strings.
    """
    options = _Options(truncate_length, no_arr, no_str)
    return {
        field.name: _plain(getattr(message, field.attribute), field, options)
        for field in fields_of(message.__msgtype__)
    }


def message_to_yaml(
    message: Any,
    *,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
    flow_style: bool = False,
) -> str:
    """Return a message as YAML, as `ros2 topic echo` prints it; arguments as of `message_to_dict`.

    `flow_style` writes sequences as [a, b], as the tool's `--flow-style`.
    """
    plain = message_to_dict(message, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str)
    return to_yaml(plain, flow_style=flow_style)


def prototype(typename: str) -> str:
    """Return a message, a service's request or an action's goal with its defaults as YAML.

    Raises:
        BridgeError: an unknown type.
    """
    parts = types.parts(typename)
    return message_to_yaml(new(types.get("/".join(parts) + _PROTOTYPES[parts.kind])))


def to_yaml(plain: Any, *, flow_style: bool = False) -> str:
    """Return dicts and lists as `ros2` writes YAML: fields in order, long lines, flat sequences."""
    return yaml.dump(
        plain, Dumper=_Dumper, allow_unicode=True, width=sys.maxsize, default_flow_style=flow_style
    )


def message_to_csv(
    message: Any, *, truncate_length: int | None = None, no_arr: bool = False, no_str: bool = False
) -> str:
    """Return a message as one line of values, as `ros2 topic echo --csv`; arguments of `message_to_dict`."""
    options = _Options(truncate_length, no_arr, no_str)
    fields = fields_of(message.__msgtype__)
    return _line(_csv(getattr(message, field.attribute), field, options) for field in fields)


class _Options(NamedTuple):
    truncate_length: int | None
    no_arr: bool
    no_str: bool


class _Dumper(yaml.SafeDumper):
    """Writes dicts in their own order, always as blocks."""

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_block(self, data: dict[str, Any]) -> yaml.MappingNode:
        items = [(self.represent_data(key), self.represent_data(value)) for key, value in data.items()]
        return yaml.MappingNode("tag:yaml.org,2002:map", items)


_Dumper.add_representer(dict, _Dumper.represent_block)


def _plain(value: Any, field: Field, options: _Options) -> Any:
    length = options.truncate_length
    if not field.many:
        return _plain_item(value, field, options)
    if options.no_arr:
        return _abbreviated(value, field)
    if length is not None and len(value) > length:
        return [*(_plain_item(item, field, options) for item in value[:length]), "..."]
    if isinstance(value, np.ndarray) and field.base != "byte":
        return value.tolist()
    return [_plain_item(item, field, options) for item in value]


def _plain_item(value: Any, field: Field, options: _Options) -> Any:
    if field.message:
        return message_to_dict(value, **options._asdict())
    if field.base in ("byte", "octet"):
        return chr(int(value) & 255)  # rclpy has bytes there, which the tool shows as text
    if isinstance(value, str):
        if options.no_str:
            return f"<string length: <{len(value)}>>"
        length = options.truncate_length
        return value if length is None or len(value) <= length else value[:length] + "..."
    return value.item() if isinstance(value, np.generic) else value


def _csv(value: Any, field: Field, options: _Options) -> str:
    length = options.truncate_length
    if not field.many:
        return _csv_item(value, field, options)
    if options.no_arr:
        return _abbreviated(value, field)
    items = [_csv_item(item, field, options) for item in value[:length]]
    return _line(items if length is None or len(value) <= length else [*items, "..."])


def _line(texts: Iterable[str]) -> str:
    """Join with commas, of which there is none after empty texts at the beginning, as in rosidl."""
    return reduce(lambda line, text: f"{line},{text}" if line else text, texts, "")


def _csv_item(value: Any, field: Field, options: _Options) -> str:
    if field.message:
        return message_to_csv(value, **options._asdict())
    if field.base in ("byte", "octet"):
        return str(bytes([int(value) & 255]))
    if isinstance(value, str):
        return str(_plain_item(value, field, options))
    # rclpy keeps arrays of fixed length in numpy, whose float32 has fewer digits.
    return str(value if field.many == "array" or not isinstance(value, np.generic) else value.item())


def _abbreviated(value: Any, field: Field) -> str:
    name = field.message or _IDL_NAMES.get(field.base, field.base)
    if field.many == "array":
        return f"<array type: {name}[{field.size}]>"
    bound = f"[{field.size}]" if field.many == "bounded" else ""
    return f"<sequence type: {name}{bound}, length: {len(value)}>"


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
