"""The node `rosapi`: what clients that only speak rosbridge can ask about the graph."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator
from functools import partial
from typing import Any

from twin.bridge import types
from twin.bridge.bags.definitions import definition
from twin.bridge.bus import Bus
from twin.bridge.graph import EndpointInfo, Graph, is_hidden
from twin.bridge.messages.as_text import message_to_dict
from twin.bridge.msgs import new, stamp
from twin.bridge.parameters.values import Parameter, value_to_python
from twin.bridge.services import Respond
from twin.bridge.srvs import GetParameters, ListParameters, SetParameters
from twin.bridge.types.fields import Field, fields_of
from twin.errors import BridgeError
from twin.web.rosbridge.learner import type_name

_PATIENCE_S = 3.0
_DOUBLE = 3  # rcl_interfaces/msg/ParameterType
_MOST_TYPES = 500
_ENDS = {"array": "[]", "bounded": "[]", "sequence": "[]", "": ""}


class Rosapi:
    """Answers from a graph that is kept up to date, and asks nodes for their parameters."""

    def __init__(self, bus: Bus, graph: Graph, now_s: Callable[[], float]) -> None:
        self._graph, self._now_s = graph, now_s
        self.node = bus.create_node("rosapi")
        for name, (kind, answer) in self._answers().items():
            service = types.ServiceType(f"rosapi_msgs/srv/{kind}")
            self.node.create_service(service, f"/rosapi/{name}", partial(_answered, service, answer))
        for name, kind, steps in (
            ("get_param", "GetParam", self._get_param),
            ("has_param", "HasParam", self._has_param),
            ("set_param", "SetParam", self._set_param),
            ("get_param_names", "GetParamNames", self._get_param_names),
        ):
            service = types.ServiceType(f"rosapi_msgs/srv/{kind}")
            self.node.create_deferred_service(service, f"/rosapi/{name}", partial(self._begin, steps))

    def _answers(self) -> dict[str, tuple[str, Callable[[Any], dict[str, Any]]]]:
        graph = self._graph
        return {
            "topics": ("Topics", lambda r: self._topics()),
            "topics_for_type": (
                "TopicsForType",
                lambda r: {"topics": _of_type(graph.topics(), r.type, "msg")},
            ),
            "topics_and_raw_types": ("TopicsAndRawTypes", lambda r: self._raw_types()),
            "topic_type": ("TopicType", lambda r: {"type": _first(graph.topics(), r.topic)}),
            "publishers": (
                "Publishers",
                lambda r: {"publishers": _nodes(graph.publishers(_absolute(r.topic)))},
            ),
            "subscribers": (
                "Subscribers",
                lambda r: {"subscribers": _nodes(graph.subscriptions(_absolute(r.topic)))},
            ),
            "services": ("Services", lambda r: {"services": [*_shown(graph.services())]}),
            "services_for_type": (
                "ServicesForType",
                lambda r: {"services": _of_type(graph.services(), r.type, "srv")},
            ),
            "service_type": ("ServiceType", lambda r: {"type": _first(graph.services(), r.service)}),
            "service_node": (
                "ServiceNode",
                lambda r: {"node": next(iter(_nodes(graph.servers(_absolute(r.service)))), "")},
            ),
            "service_providers": (
                "ServiceProviders",
                lambda r: {"providers": _nodes(graph.servers(_absolute(r.service)))},
            ),
            "service_request_details": (
                "ServiceRequestDetails",
                lambda r: {"typedefs": typedefs(f"{type_name(r.type, 'srv')}_Request")},
            ),
            "service_response_details": (
                "ServiceResponseDetails",
                lambda r: {"typedefs": typedefs(f"{type_name(r.type, 'srv')}_Response")},
            ),
            "message_details": ("MessageDetails", lambda r: {"typedefs": typedefs(type_name(r.type, "msg"))}),
            "nodes": ("Nodes", lambda r: {"nodes": self._node_names()}),
            "node_details": ("NodeDetails", lambda r: self._node_details(_absolute(r.node))),
            "interfaces": ("Interfaces", lambda r: {"interfaces": sorted(types.names())}),
            "action_servers": ("GetActionServers", lambda r: {"action_servers": self._action_servers()}),
            "action_type": ("ActionType", lambda r: {"type": _first(graph.actions(), r.action)}),
            "get_ros_version": ("GetROSVersion", lambda r: {"version": 2, "distro": "jazzy"}),
            "get_time": ("GetTime", lambda r: {"time": stamp(self.node.now_ns)}),
            "delete_param": (
                "DeleteParam",
                lambda r: {"successful": False, "reason": "ROS 2 nodes keep what they have declared"},
            ),
        }

    def _topics(self) -> dict[str, Any]:
        shown = _shown(self._graph.topics())
        return {"topics": [*shown], "types": [kinds[0] for kinds in shown.values()]}

    def _raw_types(self) -> dict[str, Any]:
        topics = self._topics()
        texts = [_definition(kind) for kind in topics["types"][:_MOST_TYPES]]
        return {**topics, "typedefs_full_text": texts}

    def _action_servers(self) -> list[str]:
        return [name for name in self._graph.actions() if self._graph.servers(f"{name}/_action/send_goal")]

    def _node_names(self) -> list[str]:
        return sorted({node.full_name for node in self._graph.nodes if not is_hidden(node.full_name)})

    def _node_details(self, name: str) -> dict[str, Any]:
        own = [each for each in self._graph.endpoints if each.node.full_name == name]
        found = {kind: sorted({e.name for e in own if e.kind == kind}) for kind in ("MS", "MP", "SS")}
        return {"subscribing": found["MS"], "publishing": found["MP"], "services": found["SS"]}

    def _begin(
        self, steps: Callable[[Any, Respond], Generator[None, None, None]], request: Any, respond: Respond
    ) -> None:
        self.node.create_task(steps(request, respond))

    def _get_param(self, request: Any, respond: Respond) -> Generator[None, None, None]:
        response = types.ServiceType("rosapi_msgs/srv/GetParam").Response
        try:
            value = yield from self._value(request.name)
        except BridgeError as error:
            respond(response("", False, str(error)))
            return
        respond(response(json.dumps(value, default=lambda array: array.tolist()), True, ""))

    def _has_param(self, request: Any, respond: Respond) -> Generator[None, None, None]:
        try:
            value = yield from self._value(request.name)
        except BridgeError:
            value = None
        respond(types.ServiceType("rosapi_msgs/srv/HasParam").Response(value is not None))

    def _set_param(self, request: Any, respond: Respond) -> Generator[None, None, None]:
        response = types.ServiceType("rosapi_msgs/srv/SetParam").Response
        try:
            node, name = _parameter(request.name)
            value = _json(request.value)
            before = yield from self._ask(node, GetParameters, "get_parameters", names=[name])
            if isinstance(value, int) and [each.type for each in before.values] == [_DOUBLE]:
                value = float(value)
            message = Parameter(name, value=value).to_parameter_msg()
            done = yield from self._ask(node, SetParameters, "set_parameters", parameters=[message])
            (result,) = done.results
        except (BridgeError, ValueError, TypeError) as error:
            respond(response(False, str(error)))
            return
        respond(response(bool(result.successful), str(result.reason)))

    def _get_param_names(self, request: Any, respond: Respond) -> Generator[None, None, None]:
        found: list[str] = []
        for node in self._node_names():
            if not self._graph.servers(f"{node}/list_parameters"):
                continue
            try:
                told = yield from self._ask(node, ListParameters, "list_parameters")
            except BridgeError:
                continue  # it has gone
            found += [f"{node}:{name}" for name in told.result.names]
        respond(types.ServiceType("rosapi_msgs/srv/GetParamNames").Response(sorted(found)))

    def _value(self, full_name: str) -> Generator[None, None, Any]:
        node, name = _parameter(full_name)
        told = yield from self._ask(node, GetParameters, "get_parameters", names=[name])
        if not told.values:
            raise BridgeError(f"{node} has no parameter {name}")
        return value_to_python(told.values[0])

    def _ask(
        self, node: str, service: types.ServiceType, name: str, **fields: Any
    ) -> Generator[None, None, Any]:
        """Ask a node; raises BridgeError if it is not there or does not answer."""
        client = self.node.create_client(service, f"{node}/{name}")
        try:
            until_s = self._now_s() + _PATIENCE_S
            future = None
            while future is None or not future.done:
                if self._now_s() > until_s:
                    raise BridgeError(f"the node {node} does not answer")
                if future is None and client.service_is_ready:
                    future = client.call_async(new(service.Request, **fields))
                yield
            return future.result
        finally:
            self.node.destroy_client(client)


def typedefs(typename: str) -> list[Any]:
    """Return a type and all types of its fields, each once, as rosapi_msgs/msg/TypeDef.

    Raises:
        BridgeError: an unknown type.
    """
    found: dict[str, Any] = {}
    waiting = [types.full_name(typename)]
    while waiting:
        name = waiting.pop(0)
        if name not in found:
            fields = fields_of(name)
            found[name] = _typedef(name, fields)
            waiting += [field.message for field in fields if field.message]
    return [*found.values()]


def _typedef(name: str, fields: tuple[Field, ...]) -> Any:
    constants = types.definitions(name)[name][0]
    example = message_to_dict(new(types.get(name)))
    return new(
        types.get("rosapi_msgs/msg/TypeDef"),
        type=name,
        fieldnames=[field.name for field in fields],
        fieldtypes=[field.message or field.base for field in fields],
        fieldarraylen=[field.size if field.many == "array" else 0 if field.many else -1 for field in fields],
        examples=[
            "[]" if field.many else "{}" if field.message else str(example[field.name]) for field in fields
        ],
        constnames=[constant[0] for constant in constants],
        constvalues=[str(constant[2]) for constant in constants],
    )


def _answered(service: types.ServiceType, answer: Callable[[Any], dict[str, Any]], request: Any) -> Any:
    try:
        return new(service.Response, **answer(request))
    except BridgeError:
        return new(service.Response)  # as rosapi: nothing is known of it


def _shown(found: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    return {name: kinds for name, kinds in found.items() if not is_hidden(name)}


def _of_type(found: dict[str, tuple[str, ...]], given: str, kind: str) -> list[str]:
    wanted = type_name(given, kind)
    return [name for name, kinds in _shown(found).items() if wanted in kinds]


def _first(found: dict[str, tuple[str, ...]], name: str) -> str:
    return next(iter(found.get(_absolute(name), ())), "")


def _nodes(endpoints: tuple[EndpointInfo, ...]) -> list[str]:
    return sorted({endpoint.node.full_name for endpoint in endpoints})


def _absolute(name: str) -> str:
    return f"/{name.lstrip('/')}"


def _definition(typename: str) -> str:
    try:
        return definition(typename)
    except BridgeError:
        return ""


def _parameter(name: str) -> tuple[str, str]:
    """Split '/node:name'."""
    node, found, parameter = name.partition(":")
    if not found:
        raise BridgeError(f"{name!r} is no parameter; valid: /node:parameter")
    return _absolute(node), parameter


def _json(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text
