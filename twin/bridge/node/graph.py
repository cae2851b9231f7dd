"""The part of a node that is about who else is there, in rclpy's words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.graph import Graph


class NodeGraph(ABC):
    """Looks at the graph: everything on this bus and, if it is networked, beyond. Each look asks anew."""

    bus: Bus

    def get_node_names(self) -> list[str]:
        """Return the nodes' names without namespaces."""
        return [node.name for node in self._graph().nodes]

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the nodes' names and namespaces."""
        return [(node.name, node.namespace) for node in self._graph().nodes]

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the topics with their types."""
        return [(name, list(kinds)) for name, kinds in self._graph().topics().items()]

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the services with their types."""
        return [(name, list(kinds)) for name, kinds in self._graph().services().items()]

    def count_publishers(self, topic: str) -> int:
        """Return how many publish on a topic.

        Raises:
            BridgeError: an invalid name.
        """
        return len(self._graph().publishers(self.resolve_name(topic)))

    def count_subscribers(self, topic: str) -> int:
        """Return how many subscribe to a topic.

        Raises:
            BridgeError: an invalid name.
        """
        return len(self._graph().subscriptions(self.resolve_name(topic)))

    @abstractmethod
    def resolve_name(self, name: str) -> str:
        """Return the absolute, remapped name."""

    def _graph(self) -> Graph:
        from twin.bridge.graph import Graph

        return Graph.snapshot(self.bus)
