"""The fields of a message type, in a form that is easier to read than rosbags'."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.base import normalize_fieldname

from twin.bridge import types
from twin.bridge.types.literals import Many
from twin.bridge.types.text import PADDING


@dataclass(frozen=True, kw_only=True)
class Field:
    """One field of a message."""

    name: str
    """As in the definition."""
    attribute: str
    """As in the Python class: `from` is `from_`."""
    base: str
    """A base type such as float64 or string; empty for a message."""
    message: str
    """package/msg/Name of a message; empty for a base type."""
    string_bound: int
    """Most characters of a bounded string; 0 for none."""
    many: Many
    """Empty for a single value."""
    size: int
    """Elements of an array, most elements of a bounded sequence; otherwise 0."""

    @property
    def typename(self) -> str:
        """The type as a definition spells it, such as `string<=5[<=3]` or `geometry_msgs/msg/Pose[]`."""
        bound = f"<={self.string_bound}" if self.string_bound else ""
        tail = {"": "", "array": f"[{self.size}]", "bounded": f"[<={self.size}]", "sequence": "[]"}[self.many]
        return f"{self.message or self.base}{bound}{tail}"


@cache
def fields_of(typename: str) -> tuple[Field, ...]:
    """Return the fields of a message type, without the padding of an empty one.

    Raises:
        BridgeError: an unknown type.
    """
    name: str = types.get(typename).__msgtype__
    definition = types.store.fielddefs[name][1]
    return tuple(_field(field, description) for field, description in definition if field != PADDING)


def _field(name: str, description: Any) -> Field:
    many: Many = ""
    size = 0
    if description[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        many = "array" if description[0] == Nodetype.ARRAY else "bounded" if description[1][1] else "sequence"
        description, size = description[1]
    node, value = description
    base, bound = ("", 0) if node == Nodetype.NAME else value
    return Field(
        name=name,
        attribute=normalize_fieldname(name),
        base=base,
        message=value if node == Nodetype.NAME else "",
        string_bound=bound,
        many=many,
        size=size,
    )
