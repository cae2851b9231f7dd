"""Topics of parameter files that nobody publishes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.msgs import LaserScan
from twin.bridge.node import Node
from twin.bridge.topics import Publisher, Subscription


def warn_of_unpublished(node: Node, topics: Mapping[str, tuple[str, type[Any]]]) -> None:
    """Warn of what a node listens to and nobody publishes, here or on the network.

    Args:
        node: Who listens.
        topics: Parameter -> the topic that it names, and its message type.
    """
    for parameter, (topic, kind) in topics.items():
        if node.count_publishers(topic):
            continue
        name = kind.__msgtype__
        others = [
            other
            for other, kinds in node.get_topic_names_and_types()
            if name in kinds
            and node.count_publishers(other)
            and other != node.resolve_name("odometry/filtered")
        ]
        there = f"; of {name} there is {', '.join(others)}" if others else f"; there is no {name}"
        node.get_logger().warn(f"{parameter}: nobody publishes {node.resolve_name(topic)}{there}")


def warn_of_unpublished_scans(bus: Bus) -> None:
    """Warn of scans that nodes of the bus wait for and nobody publishes, here or on the network."""
    kind = LaserScan.__msgtype__
    both = [e for node in bus.nodes for e in node.endpoints if isinstance(e, Publisher | Subscription)]
    scans = [endpoint for endpoint in both if endpoint.codec.msgtype == kind]
    there = {endpoint.name for endpoint in scans if isinstance(endpoint, Publisher)}
    waiting: dict[str, list[Node]] = {}
    for endpoint in scans:
        if endpoint.name not in there:
            waiting.setdefault(endpoint.name, []).append(endpoint.node)
    for topic, nodes in waiting.items():
        if nodes[0].count_publishers(topic):
            continue
        names = " and ".join(dict.fromkeys(node.fully_qualified_name for node in nodes))
        others = f"there is {', '.join(sorted(there))}; name one of these, or" if there else "there is none;"
        nodes[0].get_logger().warn(
            f"nobody publishes {topic}, awaited by {names}; of {kind} {others} give a lidar this topic"
        )
