"""A quality of service in the words of `ros2 … info --verbose`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.bridge.qos import QoS


def qos_lines(qos: QoS) -> tuple[str, ...]:
    """Return the profile as lines; source: rclpy's TopicEndpointInfo and ServiceEndpointInfo."""
    return (
        "QoS profile:",
        f"  Reliability: {qos.reliability.upper()}",
        f"  History (Depth): {f'KEEP_LAST ({qos.depth})' if qos.history == 'keep_last' else 'KEEP_ALL'}",
        f"  Durability: {qos.durability.upper()}",
        f"  Lifespan: {_duration(qos.lifespan_ns)}",
        f"  Deadline: {_duration(qos.deadline_ns)}",
        f"  Liveliness: {qos.liveliness.upper()}",
        f"  Liveliness lease duration: {_duration(qos.lease_ns)}",
    )


def _duration(nanoseconds: int) -> str:
    from twin.bridge.qos import INFINITE_NS

    return "Infinite" if nanoseconds == INFINITE_NS else f"{nanoseconds} nanoseconds"
