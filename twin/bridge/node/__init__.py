"""A node in rclpy's shape, on simulated time, run by its bus."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from twin.bridge import names
from twin.bridge.clock import Clock
from twin.bridge.msgs import ParameterEvent
from twin.bridge.node.graph import NodeGraph
from twin.bridge.node.logger import Logger, Rosout, logger_name
from twin.bridge.node.options import NodeOptions
from twin.bridge.node.tasks import NEVER_NS, Execution, Steps, Task
from twin.bridge.node.timers import Rate, Timer
from twin.bridge.parameters.node_parameters import NodeParameters
from twin.bridge.qos import PARAMETER_EVENTS, QoS, as_qos
from twin.bridge.services import FOREVER_S, Client, Respond, Service
from twin.bridge.topics import Endpoint, Publisher, Subscription
from twin.bridge.types import ServiceType
from twin.bridge.wire.keys import NodeToken
from twin.bridge.wire.late_session import Gone
from twin.errors import BridgeError
from twin.periods import Period, period_of

if TYPE_CHECKING:
    from twin.bridge.actions.client import ActionClient
    from twin.bridge.bus import Bus

M = TypeVar("M")
E = TypeVar("E", bound="OwnedEndpoint")

_EXECUTION_NS = 10_000_000
"""How often actions go on in a process that runs by the wall clock [ns]."""


class OwnedEndpoint(Protocol):
    """What leaves the graph with its node."""

    def destroy(self) -> None:
        """Leave the graph. Harmless when repeated."""


class Node(NodeParameters, NodeGraph):
    """Publishers, subscriptions, timers, services, parameters under one name; see `Bus.create_node`."""

    def __init__(
        self,
        bus: Bus,
        name: str,
        namespace: str,
        parameters: Mapping[str, Any],
        remappings: Mapping[str, str],
        options: NodeOptions | None = None,
    ) -> None:
        self.bus = bus
        self.options = options or NodeOptions()
        self.name = names.node_name(name)
        self.namespace = names.namespace(namespace)
        """'/' or '/robot'."""
        self.inbox: deque[list[Any]] = deque()
        """[endpoint or None, data, from outside]: filled by endpoints, emptied by `spin`."""
        self.due_ns = 0
        """When `spin` has something to do, whether or not something arrives [ns]; 0: the next time."""
        self.is_destroyed = self._closing = False
        self.number = bus.next_id()
        """Larger than those of nodes and endpoints that were created before it."""
        self.group: str = bus.group if bus.running is None else bus.running.group
        self.token = NodeToken(bus.domain_id, bus.session_id, self.number, self.namespace, self.name)
        self._names = names.Resolver(self.namespace, self.name, remappings, self.options.arguments.remappings)
        self._liveliness: Any = bus.wire.declare_token(str(self.token))
        self.action_clients: list[ActionClient] = []
        """All that there have been."""
        self._endpoints: list[OwnedEndpoint] = []
        self._timers: list[Timer] = []
        self._executions: list[Execution] = []
        self._logger = Logger(Rosout(self), logger_name(self))
        self._logger.levels.start(self._logger.name, self.options.arguments.log_levels)
        self._parameter_events: Publisher[ParameterEvent] | None = None
        self._start_parameters(parameters, lambda event: self.advertise_parameter_events().publish(event))
        bus.standard_services.added(self)

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

    @property
    def steady_ns(self) -> int:
        """For durations: simulated time that goes on where a clock that is followed is set [ns]."""
        return self.bus.clock.steady_ns

    def get_clock(self) -> Clock:
        """Return the bus's clock."""
        return self.bus.clock

    def get_logger(self) -> Logger:
        """Return the node's log."""
        return self._logger

    def resolve_name(self, name: str) -> str:
        """Return the absolute, remapped name of a topic, service or action.

        Raises:
            BridgeError: not a valid name, or the node is destroyed.
        """
        if self.is_destroyed:
            raise BridgeError(
                f"the node {self.fully_qualified_name} is destroyed; {name!r} is of no use any more"
            )
        return self._names.resolve(name)

    def create_publisher(
        self, msg_type: type[M], topic: str, qos: QoS | int = 10, *, on_demand: bool = False
    ) -> Publisher[M]:
        """Offer a topic.

        Args:
            msg_type: Class of the messages.
            topic: Name, which is resolved and remapped.
            qos: What is promised; a number is the depth of a reliable, volatile one.
            on_demand: Whether messages are published only while its `is_wanted` holds.

        Raises:
            BridgeError: an invalid name.
        """
        name = self.resolve_name(topic)
        return self.add_endpoint(Publisher(self, msg_type, name, as_qos(qos), on_demand=on_demand))

    def create_subscription(
        self,
        msg_type: type[M],
        topic: str,
        callback: Callable[[M], Any],
        qos: QoS | int = 10,
        *,
        frozen: bool = False,
    ) -> Subscription[M]:
        """Call back for every message on a topic, in this node's spin.

        Args:
            msg_type: Class of the messages.
            topic: Name, which is resolved and remapped.
            callback: Takes a message.
            qos: What is asked for; a number is the depth of a reliable, volatile one.
            frozen: Whether the callback, and whoever it passes them to, leaves messages as they are: then it
                can be given the object that others hear too. Without it every message is its own.

        Raises:
            BridgeError: an invalid name.
        """
        name = self.resolve_name(topic)
        return self.add_endpoint(Subscription(self, msg_type, name, callback, as_qos(qos), frozen=frozen))

    def create_timer(
        self, period_ns: Period, callback: Callable[[], Any], *, autostart: bool = True
    ) -> Timer:
        """Call back at multiples of a period [ns] of simulated time, first at the next one.

        Args:
            period_ns: More than zero; `twin.periods.period_of` a rate if it must be exact.
            callback: Takes nothing.
            autostart: Whether it runs without a `reset`.

        Raises:
            BridgeError: a period that is not positive.
        """
        timer = Timer(period_ns, callback, self.bus.clock, self.wake, autostart=autostart)
        self._timers.append(timer)
        return timer

    def create_rate(self, frequency: float) -> Rate:
        """Return a rate [Hz] for executions: `yield from rate.sleep()`.

        Raises:
            BridgeError: a frequency that is not positive.
        """
        if not 0.0 < frequency <= 1e9:
            raise BridgeError(f"a rate of {frequency} Hz; valid is more than zero")
        return Rate(period_of(frequency), self.bus.clock)

    def create_task(self, generator: Steps) -> Task:
        """Run a generator: each spin of the node advances it to its next yield, first the next spin."""
        task = Task(generator)
        self.add_execution(task)
        return task

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

    def create_client(self, srv_type: ServiceType, name: str, *, timeout_s: float = FOREVER_S) -> Client:
        """Return a client of a service.

        Args:
            srv_type: What is asked and answered.
            name: Of the service.
            timeout_s: How long [s] of wall time a server of another process may take; then the future ends
                with an error. Zenoh keeps a kilobyte of a request for so long, even of one that has been
                answered: who asks again and again, for days, gives a short one.

        Raises:
            BridgeError: an invalid name.
        """
        return self.add_endpoint(Client(self, srv_type, self.resolve_name(name), timeout_s))

    def destroy_publisher(self, publisher: Publisher[Any]) -> bool:
        """Leave a topic; return whether it was this node's."""
        return self._destroy(publisher)

    def destroy_subscription(self, subscription: Subscription[Any]) -> bool:
        """Hear a topic no more; return whether it was this node's."""
        return self._destroy(subscription)

    def destroy_service(self, service: Service) -> bool:
        """Offer a service no more, who waits gets an error; return whether it was this node's."""
        return self._destroy(service)

    def destroy_client(self, client: Client) -> bool:
        """Ask a service no more: pending futures end with an error; return whether it was this node's."""
        return self._destroy(client)

    def destroy_timer(self, timer: Timer) -> bool:
        """Stop a timer for good; return whether it was this node's."""
        timer.cancel()
        return _remove(self._timers, timer)

    def add_execution(self, execution: Execution) -> None:
        """Advance something when it is due, and whenever the node spins, after inbox and timers."""
        self._executions.append(execution)
        self.wake()

    def remove_execution(self, execution: Execution) -> None:
        """Advance something no more."""
        _remove(self._executions, execution)

    def advertise_parameter_events(self) -> Publisher[ParameterEvent]:
        """Return the publisher of /parameter_events."""
        if self._parameter_events is None:
            self._parameter_events = self.create_publisher(
                ParameterEvent, "/parameter_events", PARAMETER_EVENTS
            )
        return self._parameter_events

    def spin(self) -> None:
        """Handle what was in the inbox when called, then timers due, then one step of every execution.

        Callbacks may create and destroy whatever they like, this node too.
        """
        inbox = self.inbox
        for _ in range(len(inbox)):
            if not inbox:  # emptied by `destroy`
                return
            endpoint, data, external = inbox.popleft()
            if endpoint is not None:
                endpoint.handle(data, external)
        timers, executions = self._timers, self._executions
        if timers:
            now_ns = self.bus.clock.now_ns
            for timer in tuple(timers):
                timer.run(now_ns)
        for execution in tuple(executions):
            if execution.step():
                self.remove_execution(execution)
        due_ns = NEVER_NS
        for timer in timers:
            if (its_ns := timer.due_ns) < due_ns:
                due_ns = its_ns
        for execution in executions:
            if (its_ns := execution.due_ns) < due_ns:
                due_ns = its_ns
        self.due_ns = due_ns

    def hear(self, receiver: Any) -> None:
        """Handle what waits for one endpoint, and nothing else."""
        waiting = list(self.inbox)
        self.inbox.clear()
        self.inbox.extend(entry for entry in waiting if entry[0] is not receiver)
        for endpoint, data, external in waiting:
            if endpoint is receiver:
                endpoint.handle(data, external)

    def wake(self) -> None:
        """Spin the next time: what is due has changed."""
        self.due_ns = 0

    def go_alone(self) -> list[Any]:
        """Be without a network, in a fork; return what Zenoh made, see `Endpoint.go_alone`."""
        left: list[Any] = [self._liveliness]
        self._liveliness = Gone()
        for endpoint in self._endpoints:
            left += endpoint.go_alone() if isinstance(endpoint, Endpoint) else [endpoint]
        return left

    def destroy(self) -> None:
        """Leave the bus; executions end as if cancelled. Harmless when repeated."""
        if self.is_destroyed or self._closing:
            return
        self._closing = True
        for execution in tuple(self._executions):
            execution.close()
        self.is_destroyed = True
        for timer in self._timers:
            timer.cancel()
        for endpoint in reversed(tuple(self._endpoints)):
            endpoint.destroy()
        self._endpoints.clear()
        self._timers.clear()
        self._executions.clear()
        self.inbox.clear()
        self._liveliness.undeclare()
        self.bus.forget(self)

    @property
    def wait_ns(self) -> int | None:
        """Time until `spin` has something to do if nothing arrives [ns]; None if nothing is due."""
        if self.inbox:
            return 0
        now_ns = self.now_ns
        due = [timer.due_ns for timer in self._timers]
        due += [execution.due_ns or now_ns + _EXECUTION_NS for execution in self._executions]
        first_ns = min(due, default=NEVER_NS)
        return None if first_ns == NEVER_NS else max(0, first_ns - now_ns)

    def add_endpoint(self, endpoint: E) -> E:
        """Own an endpoint: it leaves the graph with the node."""
        self._endpoints.append(endpoint)
        return endpoint

    def _destroy(self, endpoint: OwnedEndpoint) -> bool:
        if not _remove(self._endpoints, endpoint):
            return False
        endpoint.destroy()
        return True


def _remove(things: list[Any], thing: Any) -> bool:
    """Remove a thing, not one that is equal to it; return whether it was there."""
    for index, other in enumerate(things):
        if other is thing:
            del things[index]
            return True
    return False
