"""A script that takes part in the ROS graph of its own simulation."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from twin.errors import BridgeError, nearest

if TYPE_CHECKING:
    from twin.bridge.actions.client import ActionClient, ClientGoal
    from twin.bridge.bus import Bus
    from twin.bridge.graph import Graph
    from twin.bridge.node import Node
    from twin.bridge.services import Client
    from twin.bridge.topics import Publisher, Subscription
    from twin.bridge.types import ActionType, ServiceType

Values = Mapping[str, Any]
"""A message as plain values: field -> number, text, list or mapping; what is left out has ROS's default."""


class Participant(ABC):
    """Talks to the nodes of a simulation: topics, services, actions.

    Types are those of whoever publishes, hears or offers a name in the simulation, unless they are given.
    """

    NODE = "script"
    """Name of the node through which the script talks; it is made when first needed."""

    def __init__(self) -> None:
        self._node: Node | None = None
        self._publishers: dict[tuple[str, str], Publisher[Any]] = {}
        self._clients: dict[str, tuple[ServiceType, Client]] = {}
        self._actions: dict[str, tuple[ActionType, ActionClient]] = {}

    @property
    @abstractmethod
    def bus(self) -> Bus:
        """The bus of all nodes."""

    @abstractmethod
    def run_until(self, until: float | Callable[[], bool], timeout: float = math.inf) -> bool:
        """Go on to a time or condition; see `Simulation.run_until`."""

    @property
    def node(self) -> Node:
        """The script's own node, in rclpy's shape; its callbacks run in each tick, after all others."""
        if self._node is None:
            self._node = self.bus.create_node(self.NODE)
        return self._node

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message; nodes have it in the next tick.

        Args:
            topic: Its name.
            message: An object of one of `twin.msgs`' classes, or plain values, if a node hears the topic.

        Raises:
            BridgeError: An invalid name, nobody who tells a type, or values that do not fit.
        """
        from twin.bridge import types
        from twin.bridge.messages.from_values import message_from_dict

        if isinstance(message, Mapping):
            cls = types.get(self._type_of("topic", topic, lambda graph: graph.topics()))
            message = message_from_dict(cls, message, now_ns=self.node.now_ns)
        key = topic, message.__msgtype__
        if key not in self._publishers:
            self._publishers[key] = self.node.create_publisher(type(message), topic)
        self._publishers[key].publish(message)

    def subscribe(
        self, topic: str, callback: Callable[[Any], object], msg_type: type[Any] | None = None
    ) -> Subscription[Any]:
        """Call back for every message on a topic, within ticks; `[].append` is a callback, too.

        Args:
            topic: Its name.
            callback: Gets the messages, whose arrays are numpy's and read-only.
            msg_type: Their class, of `twin.msgs`; None: as it is published.

        Returns:
            What `node.destroy_subscription` ends.

        Raises:
            BridgeError: An invalid name, or nobody who publishes it tells the type.
        """
        from twin.bridge import types
        from twin.bridge.graph import Graph
        from twin.bridge.qos import QoS

        if msg_type is None:
            msg_type = types.get(self._type_of("topic", topic, lambda graph: graph.topics()))
        offers = Graph.snapshot(self.bus).publishers(self.node.resolve_name(topic))
        latched = any(offer.qos.durability == "transient_local" for offer in offers)
        qos = QoS(depth=10, durability="transient_local" if latched else "volatile")
        return self.node.create_subscription(msg_type, topic, callback, qos)

    def wait_for_message(self, topic: str, timeout: float = 10.0) -> Any:
        """Go on until the next message comes on a topic, and return it.

        Args:
            topic: Its name.
            timeout: Simulated time [s].

        Raises:
            BridgeError: None comes in time, or nobody publishes the topic.
        """
        heard: list[Any] = []
        subscription = self.subscribe(topic, heard.append)
        try:
            if not self.run_until(lambda: bool(heard), timeout):
                raise BridgeError(f"nothing came on {subscription.name} within {timeout:g} s")
        finally:
            self.node.destroy_subscription(subscription)
        return heard[0]

    def call(self, service: str, request: Any = None, timeout: float = 10.0) -> Any:
        """Call a service, go on until it answers, and return its response.

        Args:
            service: Its name.
            request: A `Request` object of one of `twin.srvs`, or plain values; None: all defaults.
            timeout: Simulated time [s].

        Raises:
            BridgeError: No such service, values that do not fit, or no answer in time.
        """
        from twin.bridge.messages.from_values import message_from_dict
        from twin.bridge.types import ServiceType

        if service not in self._clients:
            self.bus.standard_services.want(self.node.resolve_name(service), self.bus.nodes)
            kind = ServiceType(self._type_of("service", service, lambda graph: graph.services()))
            self._clients[service] = kind, self.node.create_client(kind, service)
        kind, client = self._clients[service]
        if request is None or isinstance(request, Mapping):
            request = message_from_dict(kind.Request, request, now_ns=self.node.now_ns)
        future = client.call_async(request)
        if not self.run_until(lambda: future.done, timeout):
            client.remove_pending_request(future)
            raise BridgeError(f"the service {client.name} did not answer within {timeout:g} s")
        return future.result

    def send_goal(
        self, action: str, goal: Any = None, feedback: Callable[[Any], None] | None = None
    ) -> ClientGoal:
        """Send a goal to an action server; `run_until(lambda: goal.done)` waits for its end.

        Args:
            action: Its name.
            goal: A `Goal` object of one of `twin.actions`, or plain values; None: all defaults.
            feedback: Called with each feedback message.

        Raises:
            BridgeError: No such action, or values that do not fit.
        """
        from twin.bridge.actions import ActionClient
        from twin.bridge.messages.from_values import message_from_dict
        from twin.bridge.types import ActionType

        if action not in self._actions:
            kind = ActionType(self._type_of("action", action, lambda graph: graph.actions()))
            self._actions[action] = kind, ActionClient(self.node, kind, action)
        kind, client = self._actions[action]
        if goal is None or isinstance(goal, Mapping):
            goal = message_from_dict(kind.Goal, goal, now_ns=self.node.now_ns)
        return client.send_goal(goal, feedback)

    def _type_of(self, kind: str, name: str, known: Callable[[Graph], Mapping[str, tuple[str, ...]]]) -> str:
        """Return the type that a name of the graph has."""
        from twin.bridge.graph import Graph

        names = known(Graph.snapshot(self.bus))
        full = self.node.resolve_name(name)
        if full not in names:
            raise BridgeError(f"the simulation has no {kind} {full}; {nearest(full, names)}")
        return names[full][0]
