"""Topics of parameter files that nobody publishes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from twin.bridge.node import Node


def tell_unheard(node: Node, topics: Mapping[str, tuple[str, type[Any]]]) -> None:
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
