"""Three ways in which a ROS graph travels over Zenoh: how its keys and tokens are spelled.

`rmw_zenoh` is Jazzy and later. `humble` differs by a literal instead of type hashes. `ros2dds` is
zenoh-bridge-ros2dds: the key is the name alone. What comes in may be in any of them.
Source: rmw_zenoh docs/design.md and its humble branch; zenoh-plugin-ros2dds liveliness_mgt.rs, ros2_utils.rs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from twin.bridge.qos import QoS
from twin.bridge.wire import WIRES, Wire
from twin.bridge.wire import ros2dds as wire_ros2dds
from twin.bridge.wire.keys import EndpointKind, topic_key
from twin.errors import BridgeError

HUMBLE_HASH = "TypeHashNotSupported"


class Interface(NamedTuple):
    """A topic or service as keys spell it."""

    name: str
    """Absolute: '/robot/cmd_vel'."""
    dds_name: str
    """'geometry_msgs::msg::dds_::Twist_'."""
    type_hash: str
    """'RIHS01_<64 hex>'."""


def parse_key(key: str) -> tuple[str, Interface] | None:
    """Return domain and interface of a key in rmw_zenoh's form, None for one of another, as ros2dds's."""
    parts = key.split("/")
    if len(parts) < 4 or "::dds_::" not in parts[-2] or not parts[0].isdecimal():
        return None
    return parts[0], Interface("/" + "/".join(parts[1:-2]), *parts[-2:])


@dataclass(frozen=True)
class Naming:
    """How one bus spells what it sends; what it hears may be spelled in every way."""

    wire: Wire
    domain_id: int

    def __post_init__(self) -> None:
        """Refuse a wire that does not exist."""
        if self.wire not in WIRES:
            raise BridgeError(f"the wire {self.wire!r} is not known; valid: {', '.join(WIRES)}")

    def type_hash(self, type_hash: str) -> str:
        """Return the hash as it is sent."""
        return HUMBLE_HASH if self.wire == "humble" else type_hash

    def key(self, item: Interface) -> str:
        """Return the key on which messages or requests are sent."""
        if self.wire == "ros2dds":
            return wire_ros2dds.key(item.name)
        return topic_key(self.domain_id, item.name, item.dds_name, self.type_hash(item.type_hash))

    def token(
        self, session_id: str, kind: EndpointKind, item: Interface, qos: QoS, rmw_token: str
    ) -> str | None:
        """Return the liveliness token of an endpoint, None if another endpoint's says it too."""
        if self.wire != "ros2dds":
            return rmw_token
        return wire_ros2dds.endpoint_token(session_id, kind, item.name, item.dds_name, item.type_hash, qos)

    def heard(self, item: Interface) -> tuple[str, ...]:
        """Return the expressions for all that other processes may send; no key matches two of them.

        The type and its hash are left open: who sends another type is told so, not overlooked.
        """
        return topic_key(self.domain_id, item.name, "*", "*"), wire_ros2dds.key(item.name)


def mismatch(item: Interface, key: str) -> tuple[str, str] | None:
    """Return (reason, detail) if what comes on a key is not what an endpoint carries."""
    typed = parse_key(key)
    if typed is None:
        return None  # ros2dds: the key tells no type
    _, theirs = typed
    if theirs.dds_name != item.dds_name:
        return "type", f"{_clipped(theirs.dds_name)} instead of {item.dds_name}"
    if theirs.type_hash not in (item.type_hash, HUMBLE_HASH):
        return "type hash", f"{_clipped(theirs.type_hash)} instead of {item.type_hash}"
    return None


def _clipped(text: str) -> str:
    return text if len(text) <= 100 else f"{text[:100]}…"
