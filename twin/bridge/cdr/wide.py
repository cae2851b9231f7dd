"""Messages with wstrings, which rosbags cannot encode.

On the wire a wstring is the number of its UTF-16 units and each of them as an uint32, without a terminator
(rosidl_typesupport_fastrtps_cpp, serialization_helpers.hpp): the same bytes as an uint32[]. So such
messages are encoded in a wire form in which every wstring is an uint32[].
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from twin.bridge import types
from twin.bridge.cdr.general import read_cdr
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.lazy_store import LazyTypestore

_wire = LazyTypestore()
_UNITS = "twin/msg/Units"
_UINT32S: Any = (Nodetype.SEQUENCE, ((Nodetype.BASE, ("uint32", 0)), 0))
_wire.register({_UNITS: ([], [("units", _UINT32S)])})


@cache
def is_wide(typename: str) -> bool:
    """Say whether a message has a wstring, at any depth."""
    return any(
        field.base == "wstring" or (field.message != "" and is_wide(field.message))
        for field in fields_of(typename)
    )


def encode_wide(message: Any) -> bytes:
    """Return a message with wstrings as CDR.

    Raises:
        AttributeError, TypeError, ValueError, struct.error: a field of the wrong type.
    """
    name: str = message.__msgtype__
    _register(name)
    return bytes(_wire.serialize_cdr(_to_wire(message, name), name, little_endian=True))


def decode_wide(payload: bytes, typename: str) -> tuple[Any, int]:
    """Return a message with wstrings from CDR, and where it ends.

    Raises:
        SerdeError, struct.error, ValueError: no such message.
    """
    _register(typename)
    message, end = read_cdr(_wire, payload, typename)
    return _from_wire(message, typename), end


def _register(name: str) -> None:
    if name in _wire.fielddefs:
        return
    constants, fields = types.store.fielddefs[name]
    wire: Any = {name: (constants, [(field, _wire_type(description)) for field, description in fields])}
    for field in fields_of(name):
        if field.message:
            _register(field.message)
    _wire.register(wire)


def _wire_type(description: Any) -> Any:
    node, value = description
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        wide = value[0][0] == Nodetype.BASE and value[0][1][0] == "wstring"
        return node, ((Nodetype.NAME, _UNITS) if wide else value[0], value[1])
    return _UINT32S if node == Nodetype.BASE and value[0] == "wstring" else description


def _to_wire(message: Any, name: str) -> Any:
    values = [_field_to_wire(getattr(message, field.attribute), field) for field in fields_of(name)]
    return _wire.types[name](*values)


def _field_to_wire(value: Any, field: Field) -> Any:
    if field.base == "wstring":
        return [_wire.types[_UNITS](_units(item)) for item in value] if field.many else _units(value)
    if field.message and is_wide(field.message):
        wire = partial(_to_wire, name=field.message)
        return [*map(wire, value)] if field.many else wire(value)
    return value


def _from_wire(message: Any, name: str) -> Any:
    values = [_field_from_wire(getattr(message, field.attribute), field) for field in fields_of(name)]
    return types.get(name)(*values)


def _field_from_wire(value: Any, field: Field) -> Any:
    if field.base == "wstring":
        return [_text(item.units) for item in value] if field.many else _text(value)
    if field.message:
        plain = partial(_from_wire, name=field.message)
        return [*map(plain, value)] if field.many else plain(value)
    return value


def _units(text: str) -> NDArray[np.uint32]:
    return np.frombuffer(text.encode("utf-16-le"), np.uint16).astype(np.uint32)


def _text(units: NDArray[np.uint32]) -> str:
    if units.size and int(units.max()) > 0xFFFF:
        raise ValueError(f"{int(units.max())} is no UTF-16 unit")
    return units.astype(np.uint16).tobytes().decode("utf-16-le")
