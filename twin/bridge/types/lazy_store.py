"""rosbags' type store, which makes classes and the functions of codecs one by one, when they are first used.

rosbags makes all functions of a type and of all types inside it at once, half of them for ROS 1.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

from rosbags.interfaces import Msgdef
from rosbags.serde import primitives as primitives  # for generated code: not in the loop
from rosbags.serde.cdr import generate_deserialize_cdr, generate_getsize_cdr, generate_serialize_cdr
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore


class LazyTypestore(Typestore):
    """Message types, their classes and codecs; what is in `fielddefs` is known."""

    def __init__(self, base: ModuleType | None = None) -> None:
        super().__init__(base)
        self.types = _Classes(self.types, self.fielddefs)
        self._codecs: dict[str, _LazyMsgdef] = {}

    def register(self, typs: Any) -> None:
        """Make types known: name -> (constants, fields), with one field at least and all names distinct."""
        self.fielddefs.update(typs)

    def get_msgdef(self, typename: str) -> Msgdef[object]:
        """Return the functions of a known type."""
        found = self._codecs.get(typename)
        if found is None:
            found = self._codecs[typename] = _LazyMsgdef(typename, self)
        return found

    def get_whole_msgdef(self, typename: str) -> Msgdef[object]:
        """Return the functions of a known type, all made."""
        return super().get_msgdef(typename)


class _Classes(dict[str, Any]):
    """Message classes by name."""

    def __init__(self, classes: dict[str, Any], fielddefs: Any) -> None:
        super().__init__(classes)
        self._fielddefs = fielddefs

    def __missing__(self, name: str) -> Any:
        maker = Typestore()
        maker.register({name: self._fielddefs[name]})
        self[name] = made = maker.types[name]
        return made


class _LazyMsgdef(Msgdef[object]):
    """A type's functions; what is no attribute yet is made."""

    def __init__(self, name: str, store: LazyTypestore) -> None:
        fields = [
            (normalize_fieldname(field), description) for field, description in store.fielddefs[name][1]
        ]
        vars(self).update(name=name, fields=fields, _store=store)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        store: LazyTypestore = vars(self)["_store"]
        match name:
            case "cls":
                made: dict[str, Any] = {name: store.types[self.name]}
            case "getsize_cdr" | "size_cdr":
                function, size = generate_getsize_cdr(self.fields, store)
                made = {"getsize_cdr": function, "size_cdr": size}
            case "serialize_cdr_le" | "serialize_cdr_be":
                made = {name: generate_serialize_cdr(self.fields, store, name[-2:])}
            case "deserialize_cdr_le" | "deserialize_cdr_be":
                made = {name: generate_deserialize_cdr(self.fields, store, name[-2:])}
            case _:  # of ROS 1
                made = vars(store.get_whole_msgdef(self.name))
        vars(self).update(made)
        return made[name]
