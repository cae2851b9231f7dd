"""Names of ROS 2 types."""

from __future__ import annotations

import re
from typing import NamedTuple

from twin.errors import BridgeError

_NAME = re.compile(r"[a-z][a-z0-9_]*/(msg|srv|action)/[A-Za-z][A-Za-z0-9]*(_[A-Za-z]+)*")


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


def full_name(typename: str) -> str:
    """Return 'geometry_msgs/msg/Twist' also for 'geometry_msgs/Twist'.

    Raises:
        BridgeError: not the name of a ROS 2 type.
    """
    return "/".join(parts(typename))


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


def whole(name: str) -> str:
    """Return the interface that a part belongs to: 'p/srv/S' of 'p/srv/S_Request'; a message is whole."""
    package, kind, tail = name.split("/")
    return name if kind == "msg" else f"{package}/{kind}/{tail.partition('_')[0]}"
