"""Where definitions are kept, and how a text becomes classes. The names are full ones here; see `types`."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_typestore

from twin.bridge.interface_folders import find_definitions
from twin.bridge.interface_parser import Definition, Structure
from twin.bridge.interface_shipped import shipped, shipped_names
from twin.bridge.interface_text import definition_text
from twin.bridge.interface_values import Value
from twin.bridge.rihs01 import FieldDefs
from twin.bridge.type_names import whole
from twin.errors import BridgeError, Problem, nearest

store = get_typestore(Stores.ROS2_JAZZY)
"""Every message type known so far; grows as types are used."""
derived: FieldDefs = {}
"""Types that exist only in hashes: a service and an action as structures."""
definitions: ChainMap[str, Any] = ChainMap(store.fielddefs, derived)
"""Constants and fields of all loaded types."""
defaults: dict[str, dict[str, Value]] = {
    "geometry_msgs/msg/Quaternion": {"w": 1.0},
}
"""Default values, which rosbags drops: type name -> field -> value."""

_PADDING: Any = ("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))
_own: dict[str, Definition] = {}
_loading: list[str] = []
_in_library = frozenset(store.types)


def add(definition: Definition) -> None:
    """Keep a definition until it is used.

    Raises:
        BridgeError: a fault in its text, or other fields than a definition of this name that is known.
    """
    _add_all([definition])


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
    """Make the classes of a type, of all parts beside it and of all that it uses.

    Raises:
        BridgeError: an unknown type, or a fault in a text.
    """
    if name in definitions:
        return
    owner = whole(name)
    if owner in _loading:
        raise BridgeError(f"{owner} contains itself: {' -> '.join([*_loading, owner])}")
    definition = _own.get(owner) or shipped(owner)
    if definition is None:
        raise BridgeError(_unknown(owner))
    _loading.append(owner)
    try:
        sections = definition.parse()
        _check_references([(definition, sections)])
        for section in sections:
            for reference in section.references:
                load(reference.typename)
        _REGISTER[owner.split("/")[1]](owner, *sections)
    finally:
        _loading.pop()
    if name not in definitions:
        raise BridgeError(f"{owner} has no part {name}")


def add_fields(given: FieldDefs) -> None:
    """Make types known by their fields; see `types.add_definitions`."""
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


def text_of(name: str) -> str | None:
    """Return the text of a definition; see `types.text_of`."""
    definition = _own.get(name) or shipped(name)
    if definition is not None:
        return definition.text
    load(name)
    if name.split("/")[1] != "msg":
        return None
    constants, fields = store.fielddefs[name]
    return definition_text(name, constants, fields, defaults.get(name, {}))


def names() -> list[str]:
    """Return the names of all messages, services and actions, sorted."""
    messages = (name for name in store.types if "/msg/" in name)
    interfaces = (name for name in derived if name == whole(name))
    return sorted({*messages, *interfaces, *_own, *shipped_names()})


def _exists(name: str) -> bool:
    owner = whole(name)
    return name in definitions or owner in _own or shipped(owner) is not None


def _add_all(given: list[Definition]) -> None:
    problems: list[Problem] = []
    parsed = []
    for definition in given:
        try:
            parsed.append((definition, definition.parse()))
        except BridgeError as fault:
            problems += fault.problems
    new: dict[str, Definition] = {}
    for definition, sections in parsed:
        name = definition.typename
        other = new.get(name) or _own.get(name) or shipped(name)
        if other is None and name not in _in_library:
            new[name] = definition
        elif not _same(definition, sections, other):
            where = other.where if other is not None else "ROS's own definition"
            problems.append(
                definition.problem(f"{name} is already known with another definition: {where}", 1)
            )
        elif other is not None and other.file is None:
            new[name] = definition
    if problems:
        raise BridgeError(problems)
    before = dict(_own)
    _own.update(new)
    try:
        _check_references([item for item in parsed if item[0].file is not None])
    except BridgeError:
        _own.clear()
        _own.update(before)
        raise


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


def _check_references(parsed: list[tuple[Definition, tuple[Structure, ...]]]) -> None:
    """Tell every type that a field names and that nobody knows."""
    problems = [
        definition.problem(
            f"the type {reference.written} is not known; {_near(reference.typename)}", reference.line
        )
        for definition, sections in parsed
        for section in sections
        for reference in section.references
        if not _exists(reference.typename)
    ]
    if problems:
        raise BridgeError(problems)


def _register_message(name: str, section: Structure) -> None:
    fields = section.fields or [_PADDING]
    _register(name, section.constants, fields)
    if section.defaults:
        defaults[name] = section.defaults


def _register(name: str, constants: list[Any], fields: list[Any]) -> None:
    plain: Any = {name: (constants, fields)}
    try:
        store.register(plain)
    except TypesysError as error:  # such as fields `from` and `from_`, which Python cannot tell apart
        raise BridgeError(f"{name} cannot be used: {error}") from error


def _register_service(name: str, request: Structure, response: Structure) -> None:
    _register_message(f"{name}_Request", request)
    _register_message(f"{name}_Response", response)
    load("service_msgs/msg/ServiceEventInfo")
    event = Structure(fields=[("info", _message("service_msgs/msg/ServiceEventInfo"))])
    for field in ("request", "response"):
        element = _message(f"{name}_{field.capitalize()}")
        event.fields.append((field, (Nodetype.SEQUENCE, (element, 1))))
    _register_message(f"{name}_Event", event)
    _derive(name, request_message="_Request", response_message="_Response", event_message="_Event")


def _register_action(name: str, goal: Structure, result: Structure, feedback: Structure) -> None:
    uuid = ("goal_id", _message("unique_identifier_msgs/msg/UUID"))
    stamp = ("stamp", _message("builtin_interfaces/msg/Time"))
    _register_message(f"{name}_Goal", goal)
    _register_message(f"{name}_Result", result)
    _register_message(f"{name}_Feedback", feedback)
    _register_service(
        f"{name}_SendGoal",
        Structure(fields=[uuid, ("goal", _message(f"{name}_Goal"))]),
        Structure(fields=[("accepted", (Nodetype.BASE, ("bool", 0))), stamp]),
    )
    _register_service(
        f"{name}_GetResult",
        Structure(fields=[uuid]),
        Structure(fields=[("status", (Nodetype.BASE, ("int8", 0))), ("result", _message(f"{name}_Result"))]),
    )
    fields = [uuid, ("feedback", _message(f"{name}_Feedback"))]
    _register_message(f"{name}_FeedbackMessage", Structure(fields=fields))
    _derive(
        name,
        goal="_Goal",
        result="_Result",
        feedback="_Feedback",
        send_goal_service="_SendGoal",
        get_result_service="_GetResult",
        feedback_message="_FeedbackMessage",
    )


_REGISTER: dict[str, Callable[..., None]] = {
    "msg": _register_message,
    "srv": _register_service,
    "action": _register_action,
}


def _derive(name: str, **fields: str) -> None:
    derived[name] = ([], [(field, _message(name + suffix)) for field, suffix in fields.items()])


def _message(name: str) -> Any:
    return Nodetype.NAME, name


def _is_interface(name: str) -> bool:
    """Say whether a name is that of a service or an action rather than of a message."""
    kind = name.split("/")[1]
    return kind != "msg" and (name == whole(name) or name.endswith(("_SendGoal", "_GetResult")))


def _near(name: str) -> str:
    """Return the tail of a message about an unknown type, with the nearest names."""
    package, kind, _ = name.split("/")
    known = [*names(), *(n for n in store.types if kind != "msg")]
    same = [n for n in known if n.startswith(f"{package}/{kind}/")]
    return nearest(name, same) if same else nearest(package, {n.split("/")[0] for n in known})


def _unknown(name: str) -> str:
    package, kind, _ = name.split("/")
    if any(n.startswith(f"{package}/{kind}/") for n in names()):
        return f"the type {name} is not known; {_near(name)}"
    return f"the type {name} is not known, nor any {kind} of {package}; {_near(name)}"
