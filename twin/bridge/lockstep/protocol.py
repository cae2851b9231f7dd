"""What a run and a process in lock-step say to each other: `twin_msgs/srv/Step` and two kinds of tokens.

The service travels as any other of rmw_zenoh. The tokens tell who takes part; the ROS graph has others.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.types import ServiceType
from twin.bridge.wire.keys import demangle, mangle, topic_key

STEP = ServiceType("twin_msgs/srv/Step")
Entry: Any = types.get("twin_msgs/msg/LockstepEntry")
_EMPTY = np.zeros(0, np.uint8)
requests, responses = codec(STEP.Request), codec(STEP.Response)


def entry(kind: int, number: int = 0, key: str = "", attachment: bytes = b"", payload: bytes = b"") -> Any:
    """Return a LockstepEntry."""
    return Entry(kind, number, key, _octets(attachment), _octets(payload))


def step_key(domain_id: int, node: str) -> str:
    """Return the key of the service that steps the process of a node, such as '/controller'."""
    return topic_key(domain_id, f"{node}/step", types.dds_name(STEP.name), types.rihs01(STEP.name))


def run_token(domain_id: int) -> str:
    """Return the token of a run that steps others."""
    return f"@twin_lockstep/{domain_id}/run"


def node_token(domain_id: int, session_id: str, node: str) -> str:
    """Return the token of a node that wants to be stepped; '*' stands for any session or node."""
    return f"@twin_lockstep/{domain_id}/{session_id}/{node if node == '*' else mangle(node)}"


def parse_node_token(token: str) -> tuple[str, str]:
    """Return the session's id and the node of a `node_token`."""
    _, _, session_id, node = token.split("/")
    return session_id, demangle(node)


def _octets(data: bytes) -> Any:
    return np.frombuffer(data, np.uint8) if data else _EMPTY
