"""The node that a command is while it talks: hidden as a rule, and nothing but what it needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node


def tool_node(bus: Bus, name: str, *, shown_as: str | None = None) -> Node:
    """Return a node without parameters and log: `_ros2cli_<name>`, which lists leave out, or as asked for."""
    from twin.bridge.node.options import BARE

    return bus.create_node(shown_as or f"_ros2cli_{name}", options=BARE)
