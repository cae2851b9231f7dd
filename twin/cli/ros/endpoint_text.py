"""An endpoint in the words of `ros2 topic info --verbose` and `ros2 service info --verbose`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo

_KINDS = {
    "MP": ("Topic", "PUBLISHER"),
    "MS": ("Topic", "SUBSCRIPTION"),
    "SC": ("Service", "CLIENT"),
    "SS": ("Service", "SERVER"),
}


def endpoint_text(endpoint: EndpointInfo) -> str:
    """Return an endpoint as lines; source: rclpy (endpoint_info.py)."""
    qos = endpoint.qos
    what, kind = _KINDS[endpoint.kind]
    return "\n".join(
        (
            f"Node name: {endpoint.node.name}",
            f"Node namespace: {endpoint.node.namespace}",
            f"{what} type: {endpoint.type}",
            f"{what} type hash: {endpoint.type_hash}",
            f"Endpoint type: {kind}",
            *(["Endpoint count: 1"] if what == "Service" else []),
            f"GID: {'.'.join(f'{byte:02x}' for byte in endpoint.gid)}",
            "QoS profile:",
            f"  Reliability: {qos.reliability.upper()}",
            f"  History (Depth): {f'KEEP_LAST ({qos.depth})' if qos.history == 'keep_last' else 'KEEP_ALL'}",
            f"  Durability: {qos.durability.upper()}",
            f"  Lifespan: {_duration(qos.lifespan_ns)}",
            f"  Deadline: {_duration(qos.deadline_ns)}",
            f"  Liveliness: {qos.liveliness.upper()}",
            f"  Liveliness lease duration: {_duration(qos.lease_ns)}",
        )
    )


def _duration(nanoseconds: int) -> str:
    from twin.bridge.qos import INFINITE_NS

    return "Infinite" if nanoseconds == INFINITE_NS else f"{nanoseconds} nanoseconds"
