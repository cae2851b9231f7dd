"""Names on the wire as zenoh-bridge-ros2dds spells them.

Source: zenoh-plugin-ros2dds, liveliness_mgt.rs (tokens, QoS), ros2_utils.rs (keys, request ids).
"""

from __future__ import annotations

import struct
from typing import Literal, NamedTuple, cast, get_args

from twin.bridge.qos import QoS, profile
from twin.bridge.wire.keys import Attachment, EndpointKind

BRIDGE_NODE = "zenoh_bridge_ros2dds"
"""The name of the bridge's own node; its tokens name no others."""
_SLASH = "§"
_REQUEST = b"rqh"
_ACTION = "/_action/"
Kind = Literal["MP", "MS", "SS", "SC", "AS", "AC"]
"""rmw_zenoh's kinds, and action server and action client."""


def key(name: str) -> str:
    """Return the key of a topic or service: its name without the first slash."""
    return name.strip("/")


def bridge_token(session_id: str) -> str:
    """Return the token of a bridge as such; all of its others end with it."""
    return f"@/{session_id}/@ros2_lv"


def endpoint_token(
    session_id: str, kind: EndpointKind, name: str, dds_name: str, type_hash: str, qos: QoS
) -> str | None:
    """Return the token of an endpoint; of an action's parts only send_goal has one, the action's."""
    typename = dds_name.replace("::dds_::", "::").removesuffix("_").replace("::", "/")
    if _ACTION not in name:
        tail = f"/{_qos_string(qos, type_hash)}" if kind in ("MP", "MS") else ""
        return f"{bridge_token(session_id)}/{kind}/{_chunk(key(name))}/{_chunk(typename)}{tail}"
    action, _, part = name.partition(_ACTION)
    if part != "send_goal":
        return None
    role = "AS" if kind == "SS" else "AC"
    typename = typename.removesuffix("_SendGoal")
    return f"{bridge_token(session_id)}/{role}/{_chunk(key(action))}/{_chunk(typename)}"


class Announced(NamedTuple):
    """What a token tells."""

    session_id: str
    kind: Kind
    name: str
    """Absolute."""
    type: str
    """'geometry_msgs/msg/Twist'."""
    type_hash: str
    """'' if the bridge's ROS has none (Humble), or for services and actions."""
    qos: QoS


def parse_token(token: str) -> Announced | None:
    """Return what a token announces, None if it is no endpoint's.

    Raises:
        ValueError: a QoS in another form.
    """
    parts = token.split("/")
    if len(parts) < 6 or parts[0] != "@" or parts[2] != "@ros2_lv" or parts[3] not in get_args(Kind):
        return None
    name, typename = (part.replace(_SLASH, "/") for part in parts[4:6])
    qos, type_hash = (QoS(), "") if len(parts) < 7 else _parse_qos(parts[6])
    return Announced(parts[1], cast(Kind, parts[3]), f"/{name}", typename, type_hash, qos)


def pack_request_id(source: Attachment) -> bytes:
    """Return the attachment of a request: 'rqh', 8 bytes of the client, sequence number, endianness."""
    return _REQUEST + source.gid[:8] + struct.pack("<Q", source.sequence) + b"\x01"


def parse_request_id(data: bytes | None) -> Attachment | None:
    """Return who asks, None if the attachment is no request id."""
    if data is None or len(data) != 20 or not data.startswith(_REQUEST):
        return None
    (sequence,) = struct.unpack("<q" if data[19] else ">q", data[11:19])
    return Attachment(sequence, 0, data[3:11] + bytes(8))


def _chunk(text: str) -> str:
    return text.replace("/", _SLASH)


def _qos_string(qos: QoS, type_hash: str) -> str:
    """Return `<K if keyed>:<reliability>:<durability>:<history>,<depth>:<user data>` in DDS's numbers."""
    reliability = 0 if qos.reliability == "best_effort" else 1
    durability = 1 if qos.durability == "transient_local" else 0
    history = 1 if qos.history == "keep_all" else 0
    return f":{reliability}:{durability}:{history},{qos.depth}:typehash={type_hash};"


def _parse_qos(text: str) -> tuple[QoS, str]:
    fields = text.split(":", 4)
    if len(fields) < 4:
        raise ValueError(f"{text[:80]!r} is no QoS of zenoh-bridge-ros2dds, which looks like ':1:0:0,10'")
    _, reliability, durability, history, *user_data = fields
    kind, _, depth = history.partition(",")
    qos = profile(
        depth=int(depth) if depth.isdecimal() and len(depth) < 10 else 0,
        reliability="best_effort" if reliability == "0" else "reliable",
        durability="volatile" if durability in ("", "0") else "transient_local",
        history="keep_all" if kind == "1" else "keep_last",
    )
    pairs = dict(pair.partition("=")[::2] for pair in "".join(user_data).split(";"))
    return qos, pairs.get("typehash", "")
