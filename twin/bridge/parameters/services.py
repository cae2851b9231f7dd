"""The six services through which others see and change a node's parameters; answers as rclpy's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from twin.bridge.msgs import SetParametersResult
from twin.bridge.parameters.errors import ParameterException
from twin.bridge.parameters.parameters import Parameters
from twin.bridge.parameters.values import Parameter
from twin.bridge.srvs import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from twin.bridge.types import ServiceType
from twin.errors import BridgeError


class ParameterServices:
    """Callbacks by service name; where one name of a request is not declared, the whole answer is empty."""

    def __init__(self, node: Parameters) -> None:
        self._node = node
        self.offered: dict[str, tuple[ServiceType, Callable[[Any], Any]]] = {
            "describe_parameters": (DescribeParameters, self._describe),
            "get_parameter_types": (GetParameterTypes, self._types),
            "get_parameters": (GetParameters, self._get),
            "list_parameters": (ListParameters, self._list),
            "set_parameters": (SetParameters, self._set),
            "set_parameters_atomically": (SetParametersAtomically, self._set_atomically),
        }
        """Name below the node -> type and callback."""

    def _describe(self, request: Any) -> Any:
        return DescribeParameters.Response(_all_or_none(self._node.describe_parameter, request.names))

    def _get(self, request: Any) -> Any:
        found = _all_or_none(self._node.get_parameter, request.names)
        return GetParameters.Response([parameter.get_parameter_value() for parameter in found])

    def _types(self, request: Any) -> Any:
        found = _all_or_none(self._node.get_parameter_type, request.names)
        return GetParameterTypes.Response(np.array([kind.value for kind in found], np.uint8))

    def _list(self, request: Any) -> Any:
        return ListParameters.Response(self._node.list_parameters(request.prefixes, int(request.depth)))

    def _set(self, request: Any) -> Any:
        return SetParameters.Response([self._changed([message]) for message in request.parameters])

    def _set_atomically(self, request: Any) -> Any:
        return SetParametersAtomically.Response(self._changed(request.parameters))

    def _changed(self, messages: Sequence[Any]) -> SetParametersResult:
        try:
            return self._node.set_parameters_atomically([Parameter.from_parameter_msg(m) for m in messages])
        except ParameterException as error:
            return SetParametersResult(False, error.reason)
        except BridgeError as error:
            return SetParametersResult(False, str(error))


def _all_or_none(read: Callable[[str], Any], names: Sequence[str]) -> list[Any]:
    try:
        return [read(name) for name in names]
    except ParameterException:
        return []
