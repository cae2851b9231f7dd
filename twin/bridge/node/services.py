"""The services that every node offers in ROS: its parameters, its log levels, descriptions of its types.

In a run nobody asks 25 nodes for 7 services each, and their types cost time to load. So on a bus without a
network they are declared when the first client of one of them is made; on a networked bus at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from twin.bridge.parameters import services as parameter_services
from twin.bridge.types import ServiceType
from twin.bridge.types import description_service as type_description_service

if TYPE_CHECKING:
    from twin.bridge.node import Node

Offered = dict[str, tuple[ServiceType, Callable[[Any], Any]]]

_NAMES = {
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
    "get_logger_levels",
    "set_logger_levels",
    "get_type_description",
}


class StandardServices:
    """A bus's record of which nodes' services are wanted."""

    def __init__(self, *, at_once: bool) -> None:
        self._at_once = at_once
        self._wanted: set[str] = set()

    def want(self, service: str, nodes: Iterable[Node]) -> None:
        """Offer a service that a client is being made for, if it is a standard one of a node here.

        The node may come later.
        """
        owner, _, name = service.rpartition("/")
        if self._at_once or name not in _NAMES or owner in self._wanted:
            return
        self._wanted.add(owner)
        for node in nodes:
            if node.fully_qualified_name == owner:
                offer(node)

    def added(self, node: Node) -> None:
        """Offer a new node's services if that is wanted."""
        if self._at_once or node.fully_qualified_name in self._wanted:
            offer(node)


def offer(node: Node) -> None:
    """Declare the standard services of a node, and its publishers of /rosout and /parameter_events."""
    offered: Offered = {}
    if node.options.enable_rosout:
        node.get_logger().advertise()
    if node.options.start_parameter_services:
        node.advertise_parameter_events()
        offered |= parameter_services.offered(node)
    if node.options.enable_logger_service:
        offered |= node.get_logger().levels.offered
    if node.get_parameter("start_type_description_service").value:
        offered |= type_description_service.offered()
    for name, (srv_type, callback) in offered.items():
        node.create_service(srv_type, f"~/{name}", callback)
