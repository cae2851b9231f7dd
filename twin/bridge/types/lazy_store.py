"""rosbags' type store, which makes classes one by one, when they are first used."""

from __future__ import annotations

from typing import Any

from rosbags.typesys.store import Typestore

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
    """Message classes by name."""

    def __init__(self, fielddefs: Any) -> None:
        super().__init__()
        self._fielddefs = fielddefs

    def __missing__(self, name: str) -> Any:
        maker = Typestore()
        maker.register({name: self._fielddefs[name]})
        self[name] = made = maker.types[name]
        return made
