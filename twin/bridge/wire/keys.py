"""Names on the wire as rmw_zenoh spells them (Jazzy form): topic keys, liveliness tokens, gids, attachments.

Source: rmw_zenoh docs/design.md, liveliness_utils.cpp, attachment_helpers.cpp.
"""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct
from typing import Literal, NamedTuple

import xxhash

from twin.bridge.qos import QoS, qos_string

EndpointKind = Literal["MP", "MS", "SS", "SC"]
"""Message publisher, message subscription, service server, service client."""

_ATTACHMENT = Struct("<qqB16s")


class Attachment(NamedTuple):
    """What rmw_zenoh sends along with every sample, request and reply: 33 bytes."""

    sequence: int
    """Counts an endpoint's messages from 1."""
    time_ns: int
    """[ns]; simulated time from us."""
    gid: bytes
    """Of the endpoint, 16 bytes."""


def pack_attachment(sequence: int, time_ns: int, gid: bytes) -> bytes:
    """Return the 33 bytes."""
    return _ATTACHMENT.pack(sequence, time_ns, 16, gid)


def parse_attachment(data: bytes | None) -> Attachment | None:
    """Return an attachment, or None if there is none in this form (Jazzy before 0.2.4 had another)."""
    if data is None or len(data) != _ATTACHMENT.size:
        return None
    sequence, time_ns, length, gid = _ATTACHMENT.unpack(data)
    return Attachment(sequence, time_ns, gid) if length == 16 else None


def topic_key(domain_id: int, name: str, dds_name: str, type_hash: str) -> str:
    """Return the key of a topic or service, as 0/cmd_vel/geometry_msgs::msg::dds_::Twist_/RIHS01_9c45."""
    return f"{domain_id}/{name.strip('/')}/{dds_name}/{type_hash}"


def gid(token: str) -> bytes:
    """Return an endpoint's gid: XXH3-128 of its token, low half first."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")


@dataclass(frozen=True)
class NodeToken:
    """A node's liveliness token."""

    domain_id: int
    session_id: str
    """The Zenoh session's id, hexadecimal."""
    node_id: int
    """Unique in the session."""
    namespace: str
    """'/' or '/robot'."""
    name: str

    def __str__(self) -> str:
        return self._key(self.node_id, "NN")

    def endpoint(
        self, entity_id: int, kind: EndpointKind, name: str, dds_name: str, type_hash: str, qos: QoS
    ) -> str:
        """Return the token of one of the node's endpoints."""
        return f"{self._key(entity_id, kind)}/{mangle(name)}/{dds_name}/{type_hash}/{qos_string(qos)}"

    def _key(self, entity_id: int, kind: str) -> str:
        owner = f"@ros2_lv/{self.domain_id}/{self.session_id}/{self.node_id}/{entity_id}"
        namespace = mangle(self.namespace)
        return f"{owner}/{kind}/%/{namespace}/{self.name}"


def mangle(name: str) -> str:
    """Return a name as one chunk of a key: '/' becomes '%'."""
    return name.replace("/", "%")


def demangle(chunk: str) -> str:
    """Return the name of which `mangle` made a chunk."""
    return chunk.replace("%", "/")
