"""rosbags' type store, with message classes of our own, made one by one when they are first used."""

from __future__ import annotations

from dataclasses import make_dataclass
from typing import Any

from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

from twin.bridge.types.text import PADDING
from twin.bridge.types.type_hash import FieldDefs


class LazyTypestore(Typestore):
    """Message types and their classes; what is in `fielddefs` is known."""

    def __init__(self, fielddefs: FieldDefs) -> None:
        super().__init__()
        self.fielddefs.update(fielddefs)
        self.types = _Classes(self.fielddefs)

    def register(self, typs: Any) -> None:
        """Make types known: name -> (constants, fields), with one field at least and all names distinct."""
        self.fielddefs.update(typs)


class _Classes(dict[str, Any]):
    """Message classes by name, with slots as ROS's: a run makes thousands of messages a second."""

    def __init__(self, fielddefs: Any) -> None:
        super().__init__()
        self._fielddefs = fielddefs

    def __missing__(self, name: str) -> Any:
        constants, fields = self._fielddefs[name]
        members = {constant: value for constant, _, value in constants}
        self[name] = made = make_dataclass(
            name.replace("/", "__"),
            [(PADDING, Any, 0) if field == PADDING else normalize_fieldname(field) for field, *_ in fields],
            namespace={**members, "__msgtype__": name, "__module__": "rosbags.usertypes"},
            slots=True,
        )
        return made
