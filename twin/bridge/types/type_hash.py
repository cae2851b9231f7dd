"""The RIHS01 type hash (REP-2011): SHA-256 over a type's fields and those of all types it uses.

rosbags has such a function too, but it hashes `char` as type 13, while rosidl maps a .msg `char` to uint8;
that breaks ServiceEventInfo and with it every service and action hash.

Those of the types that come with this package are a table, so that a start computes none; `python
docs/reference.py` writes it, after a change of rosbags or of `interfaces/`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype

FieldDefs = dict[str, tuple[list[Any], list[Any]]]
"""rosbags' form: type name -> (constants, fields)."""

# type_description_interfaces/msg/FieldType
_IDS = {
    "int8": 2, "uint8": 3, "char": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "bool": 15, "byte": 16, "octet": 16,
    "string": 17, "wstring": 18,
}  # fmt: skip
BASE_NAMES = {number: base for base, number in _IDS.items() if base not in ("char", "octet")} | {13: "char"}
"""Id of a single value -> base type."""
_NESTED, _BOUNDED_STRING, _BOUNDED_WSTRING = 1, 21, 22
_ARRAY, _BOUNDED_SEQUENCE, _UNBOUNDED_SEQUENCE = 48, 96, 144


def element_of(description: Any) -> Any:
    """Return a field's own description, or that of the elements of an array or a sequence."""
    return description if description[0] in (Nodetype.BASE, Nodetype.NAME) else description[1][0]


def rihs01_of(typename: str, definitions: Mapping[str, Any]) -> str:
    """Return 'RIHS01_<64 hex>' of a type whose definition and those of all it uses are in `definitions`."""
    description = description_of(typename, definitions)
    return "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def description_of(typename: str, definitions: Mapping[str, Any]) -> dict[str, Any]:
    """Return a type and all it uses as a type description, without default values: what is hashed."""
    structs: dict[str, dict[str, Any]] = {}
    _describe(typename, definitions, structs)
    own = structs.pop(typename)
    return {
        "type_description": own,
        "referenced_type_descriptions": [structs[name] for name in sorted(structs)],
    }


def _describe(typename: str, definitions: Mapping[str, Any], structs: dict[str, dict[str, Any]]) -> None:
    if typename in structs:
        return
    fields = definitions[typename][1]
    structs[typename] = {
        "type_name": typename,
        "fields": [{"name": name, "type": _field_type(description)} for name, description in fields],
    }
    for _, description in fields:
        node, value = element_of(description)
        if node == Nodetype.NAME:
            _describe(value, definitions, structs)


def _field_type(description: Any) -> dict[str, Any]:
    offset = capacity = 0
    if description[0] == Nodetype.ARRAY:
        offset, capacity = _ARRAY, description[1][1]
    elif description[0] == Nodetype.SEQUENCE:
        capacity = description[1][1]
        offset = _BOUNDED_SEQUENCE if capacity else _UNBOUNDED_SEQUENCE
    node, value = element_of(description)
    nested, string_capacity = "", 0
    if node == Nodetype.NAME:
        number, nested = _NESTED, value
    else:
        base, string_capacity = value
        number = _IDS[base]
        if string_capacity:
            number = _BOUNDED_STRING if base == "string" else _BOUNDED_WSTRING
    return {
        "type_id": offset + number,
        "capacity": capacity,
        "string_capacity": string_capacity,
        "nested_type_name": nested,
    }


TABLE = Path(__file__).with_name("known_hashes.json")


@cache
def known_hashes() -> Mapping[str, str]:
    """Return the table: package/kind/Name of every type that an endpoint may have -> 'RIHS01_<64 hex>'."""
    found: dict[str, str] = json.loads(TABLE.read_text("utf-8"))["hashes"]
    return found
