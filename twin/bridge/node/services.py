"""The services that every node offers in ROS: its parameters, its log levels, descriptions of its types.

In a run nobody asks 25 nodes for 7 services each, and their types cost time to load. So on a bus without a
network they are declared when the first client of one of them is made; on a networked bus at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.bridge import srvs, types
from twin.bridge.msgs import SetParametersResult
from twin.bridge.parameters.errors import ParameterException
from twin.bridge.parameters.parameters import Parameters
from twin.bridge.parameters.values import Parameter
from twin.bridge.types import ServiceType
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

GetTypeDescription = ServiceType("type_description_interfaces/srv/GetTypeDescription")
Offered = dict[str, tuple[ServiceType, Callable[[Any], Any]]]
"""Name below the node -> type and callback."""

_NOT_IN_USE = "Type not currently in use by this node"  # rcl's words, in node.c
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
        if node.options.start_parameter_event_publisher:
            node.advertise_parameter_events()
        offered |= _of_parameters(node)
    if node.options.enable_logger_service:
        offered |= node.get_logger().levels.offered
    if node.get_parameter("start_type_description_service").value:
        offered["get_type_description"] = (GetTypeDescription, _described)
    for name, (srv_type, callback) in offered.items():
        node.create_service(srv_type, f"~/{name}", callback)


def _of_parameters(node: Parameters) -> Offered:
    """Return the six services through which others see and change parameters; answers as rclpy's.

    Where one name of a request is not declared, the whole answer is empty.
    """

    def describe(request: Any) -> Any:
        return srvs.DescribeParameters.Response(_all_or_none(node.describe_parameter, request.names))

    def get(request: Any) -> Any:
        found = _all_or_none(node.get_parameter, request.names)
        return srvs.GetParameters.Response([parameter.get_parameter_value() for parameter in found])

    def types(request: Any) -> Any:
        found = _all_or_none(node.get_parameter_type, request.names)
        return srvs.GetParameterTypes.Response(np.array([kind.value for kind in found], np.uint8))

    def listed(request: Any) -> Any:
        return srvs.ListParameters.Response(node.list_parameters(request.prefixes, int(request.depth)))

    def change(request: Any) -> Any:
        return srvs.SetParameters.Response([_changed(node, [message]) for message in request.parameters])

    def change_atomically(request: Any) -> Any:
        return srvs.SetParametersAtomically.Response(_changed(node, request.parameters))

    return {
        "describe_parameters": (srvs.DescribeParameters, describe),
        "get_parameter_types": (srvs.GetParameterTypes, types),
        "get_parameters": (srvs.GetParameters, get),
        "list_parameters": (srvs.ListParameters, listed),
        "set_parameters": (srvs.SetParameters, change),
        "set_parameters_atomically": (srvs.SetParametersAtomically, change_atomically),
    }


def _changed(node: Parameters, messages: Sequence[Any]) -> SetParametersResult:
    try:
        return node.set_parameters_atomically([Parameter.from_parameter_msg(m) for m in messages])
    except BridgeError as error:
        return SetParametersResult(
            False, error.reason if isinstance(error, ParameterException) else str(error)
        )


def _all_or_none(read: Callable[[str], Any], names: Sequence[str]) -> list[Any]:
    try:
        return [read(name) for name in names]
    except ParameterException:
        return []


def _described(request: Any) -> Any:
    """Answer what a type is, for who knows only its name and hash (REP-2016)."""
    from twin.bridge.types import description as type_description

    response = GetTypeDescription.Response
    if request.type_hash and not request.type_hash.startswith("RIHS01_"):
        return new(response, failure_reason="Failed to parse type hash")
    try:
        if request.type_hash and types.rihs01(request.type_name) != request.type_hash:
            return new(response, failure_reason=_NOT_IN_USE)
        description = type_description.describe(request.type_name)
        sources = type_description.sources(request.type_name) if request.include_type_sources else []
    except BridgeError as error:
        return new(response, failure_reason=f"{_NOT_IN_USE}: {error}")
    return new(response, successful=True, type_description=description, type_sources=sources)
