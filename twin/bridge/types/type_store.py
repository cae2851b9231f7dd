"""Where definitions are kept, and how a text becomes classes. The names are full ones here; see `types`."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Collection, Iterable, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.base import normalize_fieldname

from twin.bridge.types.folders import find_definitions
from twin.bridge.types.jazzy import jazzy
from twin.bridge.types.lazy_store import LazyTypestore
from twin.bridge.types.literals import BASE_TYPES, Value
from twin.bridge.types.parser import Definition, Reference, Structure
from twin.bridge.types.text import PADDING, definition_text
from twin.bridge.types.type_hash import FieldDefs
from twin.bridge.types.type_names import full_name, whole
from twin.bridge.types.type_parts import action_parts, action_structures, service_parts, service_structure
from twin.errors import BridgeError, Problem, nearest

store = LazyTypestore(jazzy())
"""Every message type known so far; grows as types are used."""
derived: FieldDefs = {}
"""Types that exist only in hashes: a service and an action as structures."""
definitions: ChainMap[str, Any] = ChainMap(store.fielddefs, derived)
"""Constants and fields of all loaded types."""
defaults: dict[str, dict[str, Value]] = {
    "geometry_msgs/msg/Quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    "rcl_interfaces/msg/ParameterDescriptor": {"read_only": False, "dynamic_typing": False},
    "sensor_msgs/msg/NavSatStatus": {"status": -2},
    "type_description_interfaces/msg/FieldType": {"type_id": 0},
}
"""Default values: type name -> field -> value. rosbags drops them; those of the types that it has are from
the Jazzy branches of common_interfaces and rcl_interfaces."""

_PADDING: Any = (PADDING, (Nodetype.BASE, ("uint8", 0)))
_own: dict[str, Definition] = {}
_loading: list[str] = []
_in_library = frozenset(store.fielddefs)
_SHIPPED = resources.files("twin.bridge") / "interfaces"
"""The definitions that come with this package, for types that rosbags lacks."""


def register(typename: str, text: str) -> None:
    """Make a type known by its definition, as in a .msg, .srv or .action file; types it uses may come later.

    Raises:
        BridgeError: the text is no definition, or the name is taken by one with other fields.
    """
    _add_all([Definition(full_name(typename), text)])


def add_folder(path: Path | str) -> list[str]:
    """Make the interfaces of a folder known: a package, a workspace, or `share` of an installation.

    Args:
        path: a folder with `msg/*.msg`, `srv/*.srv`, `action/*.action`, or with such folders inside.

    Returns:
        The names, sorted.

    Raises:
        BridgeError: no such folder, nothing in it, or faults in its files, all with their lines.
    """
    return add_folders([path])


def add_folders(paths: Iterable[Path | str]) -> list[str]:
    """Make the interfaces of folders known that may use each other's; see `add_folder`."""
    found = [definition for path in paths for definition in find_definitions(Path(path))]
    _add_all(found)
    return sorted({definition.typename for definition in found})


def load(name: str) -> None:
    """Make a type known, all parts beside it and all that it uses.

    Raises:
        BridgeError: an unknown type, or a fault in a text.
    """
    if name in definitions:
        return
    owner = whole(name)
    if owner in _loading:
        raise BridgeError(f"{owner} contains itself: {' -> '.join([*_loading, owner])}")
    definition = _own.get(owner) or _shipped(owner)
    if definition is None:
        raise BridgeError(_unknown(owner))
    _loading.append(owner)
    try:
        sections = definition.parse()
        unknown = _unknown_references(definition, sections)
        if unknown:
            raise BridgeError(unknown)
        for section in sections:
            for reference in section.references:
                load(reference.typename)
        _register_all(owner, sections)
    finally:
        _loading.pop()
    if name not in definitions:
        raise BridgeError(f"{owner} has no part {name}")


def add_definitions(given: FieldDefs, values: Mapping[str, dict[str, Value]]) -> None:
    """Make types known by their fields, in rosbags' form; every type that they use must be among them.

    Args:
        given: type name -> (constants, fields).
        values: type name -> field -> default value.

    Raises:
        BridgeError: a type that is already known with other fields.
    """
    for name, (_, fields) in given.items():
        if _exists(name):
            load(name)
            if _comparable(fields) != _comparable(definitions[name][1]):
                raise BridgeError(f"{name} is already known with other fields")
    for name, definition in given.items():
        if name not in definitions:
            if _is_interface(name):
                derived[name] = definition
            else:
                _register(name, *definition)
                defaults[name] = values.get(name, {})


def text_of(typename: str) -> str | None:
    """Return a definition's text, or None for a part of a service or an action, which has none of its own.

    Raises:
        BridgeError: an unknown type.
    """
    name = full_name(typename)
    definition = _own.get(name) or _shipped(name)
    if definition is not None:
        return definition.text
    load(name)
    if name != whole(name):
        return None
    suffixes = {"msg": [""], "srv": ["_Request", "_Response"], "action": ["_Goal", "_Result", "_Feedback"]}
    parts = [name + suffix for suffix in suffixes[name.split("/")[1]]]
    return "---\n".join(definition_text(p, *store.fielddefs[p], defaults.get(p, {})) for p in parts)


def names() -> list[str]:
    """Return every message, service and action that has a name here, sorted."""
    messages = (name for name in store.fielddefs if "/msg/" in name)
    interfaces = (name for name in derived if name == whole(name))
    return sorted({*messages, *interfaces, *_own, *_shipped_names()})


@cache
def _shipped(name: str) -> Definition | None:
    """Return the definition of 'package/kind/Name', or None."""
    package, kind, tail = name.split("/")
    file = _SHIPPED / package / kind / f"{tail}.{kind}"
    return Definition(name, file.read_text(encoding="utf-8")) if file.is_file() else None


@cache
def _shipped_names() -> tuple[str, ...]:
    return tuple(
        f"{package.name}/{kind.name}/{file.name.partition('.')[0]}"
        for package in _SHIPPED.iterdir()
        if package.is_dir()
        for kind in package.iterdir()
        for file in kind.iterdir()
    )


def _exists(name: str) -> bool:
    owner = whole(name)
    return name in definitions or owner in _own or _shipped(owner) is not None


def _add_all(given: list[Definition]) -> None:
    names = {definition.typename for definition in given}
    new: dict[str, Definition] = {}
    problems: list[Problem] = []
    for definition in given:
        name = definition.typename
        sections, faults = definition.read()
        if definition.file is not None:  # a text's references may still come
            faults += _unknown_references(definition, sections, names)
        other = new.get(name) or _own.get(name) or _shipped(name)
        is_known = other is not None or name in _in_library
        if not faults and is_known and not _same(definition, sections, other):
            where = other.where if other is not None else "ROS's own definition"
            faults.append(definition.problem(f"{name} is already known with another definition: {where}", 1))
        problems += sorted(faults, key=lambda fault: fault.line or 0)
        if other is None or other.file is None:
            new[name] = definition
    if problems:
        raise BridgeError(problems)
    _own.update(new)


def _same(definition: Definition, sections: tuple[Structure, ...], other: Definition | None) -> bool:
    if other is None:
        (section,) = sections
        fields = section.fields or [_PADDING]
        return _comparable(fields) == _comparable(store.fielddefs[definition.typename][1])
    return other.text == definition.text or [
        (section.fields, section.constants) for section in other.parse()
    ] == [(section.fields, section.constants) for section in sections]


def _comparable(fields: list[Any]) -> list[Any]:
    """Return fields without the difference between spellings that are the same type."""
    return [(name, _plain(description)) for name, description in fields]


def _plain(description: Any) -> Any:
    node, value = description
    if node == Nodetype.NAME:
        return int(node), value
    if node == Nodetype.BASE:
        return int(node), {"char": "uint8", "octet": "byte"}.get(value[0], value[0]), value[1]
    return int(node), _plain(value[0]), value[1]


def _unknown_references(
    definition: Definition, sections: Iterable[Structure], coming: Collection[str] = ()
) -> list[Problem]:
    """Return a fault for every type that a field names and that nobody knows."""
    return [
        definition.problem(
            f"the type {reference.written} is not known; {_near(reference, definition)}", reference.line
        )
        for section in sections
        for reference in section.references
        if reference.typename not in coming and not _exists(reference.typename)
    ]


def _register_all(owner: str, sections: tuple[Structure, ...]) -> None:
    """Register a definition's messages, and the structures as which a service or an action is hashed."""
    kind = owner.split("/")[1]
    if kind == "msg":
        messages = {owner: sections[0]}
    else:
        messages = (service_parts if kind == "srv" else action_parts)(owner, *sections)
        derived.update((service_structure if kind == "srv" else action_structures)(owner))
    for name, section in messages.items():
        _register(name, section.constants, section.fields or [_PADDING])
        if section.defaults:
            defaults[name] = section.defaults


def _register(name: str, constants: list[Any], fields: list[Any]) -> None:
    attributes: dict[str, str] = {}
    for written in (field[0] for field in (*fields, *constants)):
        other = attributes.setdefault(normalize_fieldname(written), written)
        if other != written:
            raise BridgeError(f"{name} cannot be used: Python cannot tell {other!r} and {written!r} apart")
    store.register({name: (constants, fields)})


def _is_interface(name: str) -> bool:
    """Say whether a name is that of a service or an action rather than of a message."""
    kind = name.split("/")[1]
    return kind != "msg" and (name == whole(name) or name.endswith(("_SendGoal", "_GetResult")))


def _near(reference: Reference, definition: Definition) -> str:
    """Return the tail of a message about an unknown type in a definition, with the nearest names."""
    if "/" in reference.written:
        return _nearest_name(reference.typename)
    own = definition.typename.split("/")[0] + "/msg/"
    return nearest(
        reference.written, [*BASE_TYPES, *(n.removeprefix(own) for n in names() if n.startswith(own))]
    )


def _nearest_name(name: str) -> str:
    package, kind, _ = name.split("/")
    known = names()
    same = [n for n in known if n.startswith(f"{package}/{kind}/")]
    return nearest(name, same) if same else nearest(package, {n.split("/")[0] for n in known})


def _unknown(name: str) -> str:
    package, kind, _ = name.split("/")
    if any(n.startswith(f"{package}/{kind}/") for n in names()):
        return f"the type {name} is not known; {_nearest_name(name)}"
    return f"the type {name} is not known, nor any {kind} of {package}; {_nearest_name(name)}"
