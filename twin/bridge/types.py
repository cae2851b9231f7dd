"""ROS 2 types by name: rosbags' Jazzy store plus the services, actions and messages it lacks.

The texts under `interfaces/` hold the fields and constants of the Jazzy branches of navigation2 (nav2_msgs),
control_msgs, rcl_interfaces, common_interfaces and example_interfaces. They are parsed when first used.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from twin.bridge.rihs01 import FieldDefs, rihs01_of
from twin.errors import BridgeError, nearest

store = get_typestore(Stores.ROS2_JAZZY)
"""Every message type known so far; grows as types are used."""

_PADDING: Any = ("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))
_NAME = re.compile(r"[a-z][a-z0-9_]*/(msg|srv|action)/[A-Z][A-Za-z0-9]*(_[A-Za-z]+)*")
_DEFAULT = re.compile(r"^[ \t]*[\w/<=]+[ \t]+(\w+)[ \t]+([^=#\s][^#\n]*?)[ \t]*(?:#.*)?$", re.MULTILINE)
_literals: dict[str, dict[str, str]] = {"geometry_msgs/msg/Quaternion": {"w": "1.0"}}
"""Default values as written in the definitions, which rosbags drops: type name -> field -> literal."""
_texts: dict[str, str] = {}
_derived: FieldDefs = {}
"""Types that exist only in hashes: a service and an action as structures."""


class Parts(NamedTuple):
    """A type name in parts."""

    package: str
    kind: str
    """msg, srv or action."""
    name: str


def parts(typename: str) -> Parts:
    """Split 'geometry_msgs/msg/Twist'; 'geometry_msgs/Twist' means the same.

    Raises:
        BridgeError: not the name of a ROS 2 type.
    """
    full = typename.replace("/", "/msg/") if typename.count("/") == 1 else typename
    if not _NAME.fullmatch(full):
        raise BridgeError(
            f"{typename!r} is not a type name; valid: package/msg/Name, package/srv/Name, package/action/Name"
        )
    return Parts(*full.split("/"))


def dds_name(typename: str) -> str:
    """Return the type as keys spell it: geometry_msgs::msg::dds_::Twist_."""
    package, kind, name = parts(typename)
    return f"{package}::{kind}::dds_::{name}_"


def from_dds_name(name: str) -> str | None:
    """Return the type of which `dds_name` made a name, or None if it is of another form."""
    package, _, tail = name.partition("::")
    kind, _, plain = tail.partition("::dds_::")
    full = f"{package}/{kind}/{plain.removesuffix('_')}"
    return full if _NAME.fullmatch(full) and plain.endswith("_") else None


def register(typename: str, text: str) -> None:
    """Make a type known by its definition, as in a .msg, .srv or .action file; types it uses may come later.

    Raises:
        BridgeError: the text is no definition, or the name is taken by a different one.
    """
    name = "/".join(parts(typename))
    if _texts.setdefault(name, text) != text:
        raise BridgeError(f"the type {name} is already known with another definition")


def get(typename: str) -> type[Any]:
    """Return the class of a message or of a service's or action's part, as 'std_srvs/srv/Trigger_Request'.

    Raises:
        BridgeError: an unknown type; the message lists the package's types.
    """
    name = "/".join(parts(typename))
    if name not in store.types:
        _load(name)
    if name not in store.types:
        raise BridgeError(f"{name} is no message; its parts are, such as {name}_Request or {name}_Goal")
    return store.types[name]


def rihs01(typename: str) -> str:
    """Return a type's RIHS01 hash, 'RIHS01_<64 hex>', of a message, service or action.

    Raises:
        BridgeError: an unknown type.
    """
    name = "/".join(parts(typename))
    if name not in store.types and name not in _derived:
        _load(name)
    return _rihs01(name)


@dataclass(frozen=True)
class ServiceType:
    """A service; its classes are made when first asked for."""

    name: str
    """package/srv/Name, or package/action/Name_SendGoal."""

    @cached_property
    def Request(self) -> type[Any]:
        """The request's message class."""
        return get(f"{self.name}_Request")

    @cached_property
    def Response(self) -> type[Any]:
        """The response's message class."""
        return get(f"{self.name}_Response")


@dataclass(frozen=True)
class ActionType:
    """An action; its classes are made when first asked for."""

    name: str
    """package/action/Name."""

    @cached_property
    def Goal(self) -> type[Any]:
        """The goal's message class."""
        return get(f"{self.name}_Goal")

    @cached_property
    def Result(self) -> type[Any]:
        """The result's message class."""
        return get(f"{self.name}_Result")

    @cached_property
    def Feedback(self) -> type[Any]:
        """The feedback's message class."""
        return get(f"{self.name}_Feedback")

    @cached_property
    def FeedbackMessage(self) -> type[Any]:
        """The class of what travels on `<action>/_action/feedback`: goal_id and feedback."""
        return get(f"{self.name}_FeedbackMessage")

    @property
    def SendGoal(self) -> ServiceType:
        """The service that asks for a goal."""
        return ServiceType(f"{self.name}_SendGoal")

    @property
    def GetResult(self) -> ServiceType:
        """The service that answers when the goal has ended."""
        return ServiceType(f"{self.name}_GetResult")


def dtype_of(base: str) -> np.dtype[Any]:
    """Return the numpy type of the elements of an array of a base type other than string."""
    return np.dtype({"char": "uint8", "byte": "uint8", "octet": "uint8"}.get(base, base))


def defaults(typename: str) -> dict[str, str]:
    """Return the literals of the fields that have a default other than zero."""
    get(typename)
    return _literals.get(typename, {})


@cache
def _rihs01(name: str) -> str:
    return rihs01_of(name, {**store.fielddefs, **_derived})


def _load(name: str) -> None:
    """Parse the definition that `name` or the part `name` belongs to, and all it uses."""
    package, kind, tail = name.split("/")
    whole = name if kind == "msg" else f"{package}/{kind}/{tail.partition('_')[0]}"
    text = _texts.get(whole) or _shipped_text(whole)
    if kind == "msg":
        _register_struct(name, text)
        return
    sections = re.split(r"^---.*$", text, flags=re.MULTILINE)
    if len(sections) != (2 if kind == "srv" else 3):
        raise BridgeError(
            f"the definition of {whole} has {len(sections)} sections; valid: 2 in a service, 3 in an action"
        )
    if kind == "srv":
        _register_service(whole, *sections)
    else:
        _register_action(whole, *sections)
    if name not in store.fielddefs and name not in _derived:
        raise BridgeError(f"{whole} has no part {name}")


def _register_service(name: str, request: str, response: str) -> None:
    _register_struct(f"{name}_Request", request)
    _register_struct(f"{name}_Response", response)
    one = "{0}_{1}[<=1] {2}"
    _register_struct(
        f"{name}_Event",
        "service_msgs/msg/ServiceEventInfo info\n"
        f"{one.format(name, 'Request', 'request')}\n{one.format(name, 'Response', 'response')}",
    )
    _derive(name, request_message="_Request", response_message="_Response", event_message="_Event")


def _register_action(name: str, goal: str, result: str, feedback: str) -> None:
    uuid = "unique_identifier_msgs/msg/UUID goal_id\n"
    _register_struct(f"{name}_Goal", goal)
    _register_struct(f"{name}_Result", result)
    _register_struct(f"{name}_Feedback", feedback)
    stamp = "bool accepted\nbuiltin_interfaces/msg/Time stamp"
    _register_service(f"{name}_SendGoal", f"{uuid}{name}_Goal goal", stamp)
    _register_service(f"{name}_GetResult", uuid, f"int8 status\n{name}_Result result")
    _register_struct(f"{name}_FeedbackMessage", f"{uuid}{name}_Feedback feedback")
    _derive(
        name,
        goal="_Goal",
        result="_Result",
        feedback="_Feedback",
        send_goal_service="_SendGoal",
        get_result_service="_GetResult",
        feedback_message="_FeedbackMessage",
    )


def _derive(name: str, **fields: str) -> None:
    _derived[name] = ([], [(field, (Nodetype.NAME, name + suffix)) for field, suffix in fields.items()])


def _register_struct(name: str, text: str) -> None:
    try:
        definitions = get_types_from_msg(text, name)
    except Exception as error:  # rosbags documents no single parser error
        raise BridgeError(f"the definition of {name} cannot be parsed: {error}") from error
    ((constants, fields),) = definitions.values()
    fields = [(field, _plain(description)) for field, description in fields] or [_PADDING]
    store.register({name: (constants, fields)})
    _literals[name] = {field: literal for field, literal in _DEFAULT.findall(text) if "[" not in literal}
    for _, description in fields:
        used = description[1] if description[0] == Nodetype.NAME else description[1][0]
        typename = used if description[0] == Nodetype.NAME else used[1] if used[0] == Nodetype.NAME else None
        if isinstance(typename, str) and typename not in store.types:
            _load(typename)


def _plain(description: Any) -> Any:
    """Undo rosbags' spelling 'pkg/srv/msg/Name' in a field's description."""
    node, value = description
    if node == Nodetype.NAME:
        return node, value.replace("/srv/msg/", "/srv/")
    if node == Nodetype.BASE:
        return description
    return node, (_plain(value[0]), value[1])


def _shipped_text(name: str) -> str:
    package, kind, tail = name.split("/")
    folder = resources.files("twin.bridge") / "interfaces" / package / kind
    file = folder / f"{tail}.{kind}"
    if file.is_file():
        return file.read_text(encoding="utf-8")
    shipped = [f.name.partition(".")[0] for f in folder.iterdir()] if folder.is_dir() else []
    in_store = [key.split("/")[2] for key in store.types if key.startswith(f"{package}/{kind}/")]
    known = {f"{package}/{kind}/{n}" for n in (*shipped, *in_store)}
    packages = {key.split("/")[0] for key in store.types}
    if not known:
        raise BridgeError(
            f"the type {name} is not known, nor any {kind} of {package}; {nearest(package, packages)}"
        )
    raise BridgeError(f"the type {name} is not known; {nearest(name, known)}")
