"""The six services through which others see and change a node's parameters; answers as rclpy's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from twin.bridge import srvs
from twin.bridge.msgs import SetParametersResult
from twin.bridge.parameters.errors import ParameterException
from twin.bridge.parameters.parameters import Parameters
from twin.bridge.parameters.values import Parameter
from twin.bridge.types import ServiceType
from twin.errors import BridgeError


def offered(node: Parameters) -> dict[str, tuple[ServiceType, Callable[[Any], Any]]]:
    """Return the services: name below the node -> type and callback.

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
