"""The node that a command is while it talks: hidden, and nothing but what it needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node


def tool_node(bus: Bus, name: str) -> Node:
    """Return a node `_ros2cli_<name>` without parameters and log; lists leave it out."""
    from twin.bridge.node_options import BARE

    return bus.create_node(f"_ros2cli_{name}", options=BARE)
