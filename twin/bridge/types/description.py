"""A type that travels by itself: what a node's `~/get_type_description` service answers (REP-2016).

`describe` makes the description of any known type; `learn` makes an unknown type known from one.
"""

from __future__ import annotations

import ast
import re
from typing import Any

from rosbags.interfaces import Nodetype

from twin.bridge import types
from twin.bridge.types.default_values import new
from twin.bridge.types.literals import MOST_NUMBERS, MOST_OBJECTS, STRINGS, Scalar, Value, parse_scalar
from twin.bridge.types.type_hash import BASE_NAMES, FieldDefs, description_of, element_of, rihs01_of
from twin.errors import BridgeError

TypeDescription: Any = types.get("type_description_interfaces/msg/TypeDescription")
TypeSource: Any = types.get("type_description_interfaces/msg/TypeSource")
_Individual: Any = types.get("type_description_interfaces/msg/IndividualTypeDescription")
_Field: Any = types.get("type_description_interfaces/msg/Field")
_FieldType: Any = types.get("type_description_interfaces/msg/FieldType")

_FIELD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_DEEPEST = 32
_NESTED, _BOUNDED_STRING, _BOUNDED_WSTRING = 1, 21, 22


def describe(typename: str) -> Any:
    """Return a type's type_description_interfaces/msg/TypeDescription.

    Args:
        typename: package/msg/Name, package/srv/Name, package/action/Name or a part such as
            package/srv/Name_Request.

    Raises:
        BridgeError: an unknown type.
    """
    plain = description_of(types.full_name(typename), types.definitions(typename))
    return TypeDescription(
        type_description=_individual(plain["type_description"]),
        referenced_type_descriptions=[_individual(item) for item in plain["referenced_type_descriptions"]],
    )


def sources(typename: str) -> list[Any]:
    """Return the texts of a type and of all that it uses, as type_description_interfaces/msg/TypeSource.

    Types that have no text, being made from others, have the encoding 'implicit', as in rosidl.

    Raises:
        BridgeError: an unknown type.
    """
    name = types.full_name(typename)
    used = [item.type_name for item in describe(name).referenced_type_descriptions]
    return [_source(item) for item in (name, *used)]


def learn(description: Any, type_hash: str | None = None) -> str:
    """Make the types of a TypeDescription known and return the name of the one that it describes.

    Args:
        description: type_description_interfaces/msg/TypeDescription.
        type_hash: the RIHS01 that the description must have, such as that of an endpoint's token.

    Raises:
        BridgeError: another hash, a description that describes nothing, or a type that is already known
            with other fields.
    """
    name, definitions = read(description, type_hash)
    items = [description.type_description, *description.referenced_type_descriptions]
    defaults = {item.type_name: _defaults(item, definitions[item.type_name][1]) for item in items}
    types.add_definitions(definitions, defaults)
    return name


def read(description: Any, type_hash: str | None = None) -> tuple[str, FieldDefs]:
    """Return the type that a TypeDescription describes, and the fields of it and of all that it uses.

    Args:
        description: type_description_interfaces/msg/TypeDescription.
        type_hash: the RIHS01 that it must have.

    Raises:
        BridgeError: another hash, or a description that describes nothing.
    """
    items = [description.type_description, *description.referenced_type_descriptions]
    name: str = description.type_description.type_name
    definitions: FieldDefs = {
        item.type_name: ([], [_definition(item, f) for f in item.fields]) for item in items
    }
    _check(name, definitions)
    found = rihs01_of(name, definitions)
    if type_hash is not None and found != type_hash:
        raise BridgeError(f"the description of {name} has the hash {found}, not {type_hash}")
    return name, definitions


def _individual(plain: dict[str, Any]) -> Any:
    name, defaults = plain["type_name"], {}
    if name in types.store.fielddefs:
        defaults = types.defaults(name)
    fields = [
        _Field(field["name"], _FieldType(**field["type"]), _default_text(defaults.get(field["name"])))
        for field in plain["fields"]
    ]
    return _Individual(name, fields)


def _default_text(value: Value | None) -> str:
    """Return a default as rosidl writes it: 1.0, True, (0, 1)."""
    return "" if value is None else str(tuple(value) if isinstance(value, list) else value)


def _source(name: str) -> Any:
    text = types.text_of(name)
    if text is None:
        return new(TypeSource, type_name=name, encoding="implicit")
    return TypeSource(type_name=name, encoding=types.parts(name).kind, raw_file_contents=text)


def _definition(item: Any, field: Any) -> tuple[str, Any]:
    """Return a field in rosbags' form."""
    number: int = field.type.type_id
    many, kind = divmod(number, 48)
    if kind == _NESTED:
        element: Any = (Nodetype.NAME, field.type.nested_type_name)
    elif kind in (_BOUNDED_STRING, _BOUNDED_WSTRING):
        base = "string" if kind == _BOUNDED_STRING else "wstring"
        element = (Nodetype.BASE, (base, field.type.string_capacity))
    elif kind in BASE_NAMES:
        element = (Nodetype.BASE, (BASE_NAMES[kind], 0))
    else:
        raise BridgeError(
            f"{item.type_name}.{field.name} has the type id {number}, which no .msg file can have"
        )
    if many == 0:
        return field.name, element
    node = Nodetype.ARRAY if many == 1 else Nodetype.SEQUENCE
    return field.name, (node, (element, 0 if many == 3 else field.type.capacity))


def _defaults(item: Any, fields: list[tuple[str, Any]]) -> dict[str, Value]:
    """Return the values of the fields of a description that have a default.

    Raises:
        BridgeError: a text that is no value of its field's type.
    """
    found: dict[str, Value] = {}
    for field, (name, (node, value)) in zip(item.fields, fields, strict=True):
        if not field.default_value:
            continue
        inner, element = element_of((node, value))
        try:
            if inner != Nodetype.BASE:
                raise ValueError("only plain values have a default")
            if node == Nodetype.BASE:
                found[name] = _parse(element, field.default_value)
            else:
                items = ast.literal_eval(field.default_value)
                found[name] = [_parse(element, str(one)) for one in items]
        except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
            raise BridgeError(
                f"{item.type_name}.{name} has a default that it cannot have: {error}"
            ) from error
        if node == Nodetype.ARRAY and len(found[name]) != value[1]:  # type: ignore[arg-type]
            raise BridgeError(f"{item.type_name}.{name} has a default of another length than the array")
    return found


def _parse(element: tuple[str, int], text: str) -> Scalar:
    base, bound = element
    return text if base in STRINGS else parse_scalar(base, text, bound)  # texts have no quotes here


def _check(name: str, definitions: FieldDefs, path: tuple[str, ...] = ()) -> None:
    """Refuse what no file could define: the names become Python code, and the sizes memory.

    Raises:
        BridgeError: says what and where.
    """
    types.parts(name)
    if name in path or len(path) > _DEEPEST:
        raise BridgeError(f"the description of {path[0]} contains {name} inside of itself, or too deep")
    if name not in definitions:
        raise BridgeError(f"the description of {path[0]} lacks {name}, a type of {path[-1]}")
    fields = definitions[name][1]
    if not fields or len({field for field, _ in fields}) < len(fields):
        raise BridgeError(f"the description of {name} has no fields, or one twice")
    for field, (node, value) in fields:
        if not _FIELD.fullmatch(field):
            raise BridgeError(
                f"{field!r} is no name of a field of {name}; valid: letters, digits, underscores"
            )
        inner, used = element_of((node, value))
        plain = inner == Nodetype.BASE and used[0] not in STRINGS
        if node == Nodetype.ARRAY and not 0 < value[1] <= (MOST_NUMBERS if plain else MOST_OBJECTS):
            raise BridgeError(f"{name}.{field} is an array of {value[1]} elements, which is none or too many")
        if inner == Nodetype.NAME:
            _check(used, definitions, (*path, name))
