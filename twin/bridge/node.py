"""A node in rclpy's shape, on simulated time, run by its bus."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from twin.bridge import names
from twin.bridge.keys import NodeToken
from twin.bridge.logger import Logger
from twin.bridge.parameters import Parameter, Parameters
from twin.bridge.qos import QoS, as_qos
from twin.bridge.services import Client, Respond, Service
from twin.bridge.topics import Publisher, Subscription
from twin.bridge.types import ServiceType
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.bus import Bus

M = TypeVar("M")
E = TypeVar("E", bound="OwnedEndpoint")

_EXECUTION_NS = 10_000_000
"""How often actions go on in a process that runs by the wall clock [ns]."""


class OwnedEndpoint(Protocol):
    """What leaves the graph with its node."""

    def destroy(self) -> None:
        """Leave the graph. Harmless when repeated."""


class Execution(Protocol):
    """Something that a node advances once in every spin: an action server."""

    def step(self) -> None:
        """Go on to the next yield."""

    def close(self) -> None:
        """End where it waits; the bus still works."""


class Timer:
    """Calls back at multiples of a period of simulated time; several missed ones are one call."""

    def __init__(self, period_ns: int, callback: Callable[[], Any], now_ns: int) -> None:
        if period_ns <= 0:
            raise BridgeError(f"a timer period of {period_ns} ns; valid is more than zero")
        self.period_ns = period_ns
        self._callback = callback
        self.reset(now_ns)

    def reset(self, now_ns: int) -> None:
        """Fire next at the first multiple of the period after `now_ns`."""
        self.next_ns = (now_ns // self.period_ns + 1) * self.period_ns
        self._cancelled = False

    def cancel(self) -> None:
        """Fire no more, until reset."""
        self._cancelled = True

    @property
    def is_cancelled(self) -> bool:
        """Whether it fires no more."""
        return self._cancelled

    def run(self, now_ns: int) -> None:
        """Call back if due."""
        if now_ns >= self.next_ns and not self._cancelled:
            self.reset(now_ns)
            self._callback()


class Node:
    """Publishers, subscriptions, timers, services, parameters under one name; see `Bus.create_node`."""

    def __init__(
        self,
        bus: Bus,
        name: str,
        namespace: str,
        parameters: Mapping[str, Any],
        remappings: Mapping[str, str],
    ) -> None:
        self.bus = bus
        self.name = names.node_name(name)
        self.namespace = names.namespace(namespace)
        """'/' or '/robot'."""
        self.inbox: deque[list[Any]] = deque()
        """[endpoint or None, data, from outside]: filled by endpoints, emptied by `spin`."""
        self.token = NodeToken(bus.domain_id, bus.session_id, bus.next_id(), self.namespace, self.name)
        self._names = names.Resolver(self.namespace, self.name, remappings)
        self._parameters = Parameters(self.fully_qualified_name, parameters)
        self._liveliness: Any = bus.session.liveliness().declare_token(str(self.token))
        self._endpoints: list[OwnedEndpoint] = []
        self._timers: list[Timer] = []
        self._executions: list[Execution] = []
        self._logger = Logger(self)

    @property
    def fully_qualified_name(self) -> str:
        """Namespace and name: '/robot/amcl'."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    @property
    def endpoints(self) -> tuple[OwnedEndpoint, ...]:
        """Publishers, subscriptions, services and clients in the order of their creation."""
        return tuple(self._endpoints)

    @property
    def now_ns(self) -> int:
        """Simulated time [ns]."""
        return self.bus.clock.now_ns

    def get_logger(self) -> Logger:
        """Return the node's log."""
        return self._logger

    def resolve_name(self, name: str) -> str:
        """Return the absolute, remapped name of a topic, service or action.

        Raises:
            BridgeError: not a valid name.
        """
        return self._names.resolve(name)

    def create_publisher(self, msg_type: type[M], topic: str, qos: QoS | int = 10) -> Publisher[M]:
        """Offer a topic; a number as QoS is the depth of a reliable, volatile one.

        Raises:
            BridgeError: an invalid name.
        """
        return self.add_endpoint(Publisher(self, msg_type, self.resolve_name(topic), as_qos(qos)))

    def create_subscription(
        self, msg_type: type[M], topic: str, callback: Callable[[M], Any], qos: QoS | int = 10
    ) -> Subscription[M]:
        """Call back for every message on a topic, in this node's spin.

        Raises:
            BridgeError: an invalid name.
        """
        return self.add_endpoint(
            Subscription(self, msg_type, self.resolve_name(topic), callback, as_qos(qos))
        )

    def create_timer(self, period_ns: int, callback: Callable[[], Any]) -> Timer:
        """Call back at multiples of a period [ns] of simulated time, first at the next one.

        Raises:
            BridgeError: a period that is not positive.
        """
        timer = Timer(period_ns, callback, self.now_ns)
        self._timers.append(timer)
        return timer

    def create_service(self, srv_type: ServiceType, name: str, callback: Callable[[Any], Any]) -> Service:
        """Offer a service; the callback takes the request and returns the response.

        Raises:
            BridgeError: an invalid name.
        """
        return self.create_deferred_service(
            srv_type, name, lambda request, respond: respond(callback(request))
        )

    def create_deferred_service(
        self, srv_type: ServiceType, name: str, callback: Callable[[Any, Respond], None]
    ) -> Service:
        """Offer a service whose callback takes the request and a function to respond with, now or later.

        Raises:
            BridgeError: an invalid name.
        """
        return self.add_endpoint(Service(self, srv_type, self.resolve_name(name), callback))

    def create_client(self, srv_type: ServiceType, name: str) -> Client:
        """Return a client of a service.

        Raises:
            BridgeError: an invalid name.
        """
        return self.add_endpoint(Client(self, srv_type, self.resolve_name(name)))

    def declare_parameter(self, name: str, default: Any) -> Parameter:
        """Declare a parameter; the value given at the node's creation goes before the default.

        Raises:
            BridgeError: declared twice, or a value of another type than the default.
        """
        return self._parameters.declare(name, default)

    def get_parameter(self, name: str) -> Parameter:
        """Return a declared parameter.

        Raises:
            BridgeError: not declared.
        """
        return self._parameters.get(name)

    def get_parameters(self, parameter_names: list[str]) -> list[Parameter]:
        """Return declared parameters.

        Raises:
            BridgeError: one is not declared.
        """
        return [self._parameters.get(name) for name in parameter_names]

    def set_parameter(self, name: str, value: Any) -> Parameter:
        """Change a declared parameter.

        Raises:
            BridgeError: not declared, another type, or refused by the node.
        """
        return self._parameters.set(name, value)

    def add_on_set_parameter_callback(self, callback: Callable[[Parameter], None]) -> None:
        """Call back before a parameter changes; raise BridgeError in it to refuse."""
        self._parameters.add_on_set_callback(callback)

    def add_execution(self, execution: Execution) -> None:
        """Advance something once in every spin, after inbox and timers."""
        self._executions.append(execution)

    def spin(self) -> None:
        """Handle what was in the inbox when called, then timers due, then one step of every execution."""
        inbox = self.inbox
        for _ in range(len(inbox)):
            endpoint, data, external = inbox.popleft()
            if endpoint is not None:
                endpoint.handle(data, external)
        now_ns = self.bus.clock.now_ns
        for timer in self._timers:
            timer.run(now_ns)
        for execution in self._executions:
            execution.step()

    def destroy(self) -> None:
        """Leave the bus. Harmless when repeated."""
        for execution in self._executions:
            execution.close()
        for endpoint in reversed(self._endpoints):
            endpoint.destroy()
        self._endpoints.clear()
        self._timers.clear()
        self._executions.clear()
        self.inbox.clear()
        if self._liveliness is not None:
            self._liveliness.undeclare()
            self._liveliness = None
        self.bus.forget(self)

    @property
    def wait_ns(self) -> int | None:
        """Time until `spin` has something to do if nothing arrives [ns]; None if nothing is due."""
        if self.inbox:
            return 0
        due = [timer.next_ns - self.now_ns for timer in self._timers if not timer.is_cancelled]
        due += [_EXECUTION_NS] * bool(self._executions)
        return max(0, min(due)) if due else None

    def add_endpoint(self, endpoint: E) -> E:
        """Own an endpoint: it leaves the graph with the node."""
        self._endpoints.append(endpoint)
        return endpoint
