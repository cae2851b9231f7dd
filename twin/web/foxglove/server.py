"""A live graph on Foxglove's websocket: our CDR goes through as it is."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.bags.asked_definitions import AskedDefinitions, Kind
from twin.bridge.bags.definitions import definition
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.graph import EndpointInfo, Graph, is_hidden
from twin.bridge.qos import QoS
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.topics.raw_publisher import RawPublisher
from twin.errors import BridgeError
from twin.web.assets import Assets
from twin.web.foxglove.errands import Errands
from twin.web.foxglove.parameters import RemoteParameters

if TYPE_CHECKING:
    import foxglove
    from foxglove.websocket import ChannelView, Client, ClientChannel

_HISTORY = QoS(depth=1000, durability="transient_local")
"""Latched samples that were published before come too; other publishers do not mind."""
_OF_TOOLS = ("rcl_interfaces/srv/", "type_description_interfaces/srv/")
"""Services of every node, which parameters and definitions are asked by."""


def sdk() -> Any:
    """Return the module `foxglove`.

    Raises:
        BridgeError: it is not installed.
    """
    try:
        import foxglove
    except ImportError:
        raise BridgeError("Foxglove's SDK is not installed: pip install 'twin[foxglove]'") from None
    return foxglove


class FoxgloveServer:
    """Serves on the loopback device; call `update` after every spin of the bus."""

    def __init__(
        self, bus: Bus, *, port: int = 8765, control: bool = False, folder: Path | None = None
    ) -> None:
        """Begin to serve.

        Args:
            bus: That has joined the graph.
            port: 0: a free one.
            control: Whether clients may publish, call services and set parameters.
            folder: Around which packages of `package://` are looked for; None: the working directory.

        Raises:
            BridgeError: no SDK, or the port is taken.
        """
        self._sdk = sdk()
        capability = self._sdk.Capability
        self._control = control
        self._node = bus.create_node("foxglove_bridge")
        self._own = self._node.fully_qualified_name
        self._errands = Errands(self._node)
        self._parameters = RemoteParameters(self._errands)
        self._asked = AskedDefinitions(self._node)
        self._graph = Graph.watch(bus)
        self._changes = -1
        self._context = self._sdk.Context()
        self._channels: dict[str, tuple[str, foxglove.Channel]] = {}
        """Type and channel, by topic."""
        self._undefined: dict[str, EndpointInfo] = {}
        """Topics of which nobody has told the definition yet."""
        self._clients: Counter[str] = Counter()
        """How many have subscribed, by topic."""
        self._heard: dict[str, RawSubscription] = {}
        self._said: dict[tuple[int, int], RawPublisher] = {}
        """What clients publish, by client and channel."""
        self._services: dict[str, str] = {}
        """Types of those that are offered."""
        can = [capability.Time, capability.Parameters, capability.ConnectionGraph]
        if control:
            can += [capability.ClientPublish, capability.Services]
        try:
            self._server = self._sdk.start_server(
                name="twin",
                host="127.0.0.1",
                port=port,
                capabilities=can,
                supported_encodings=["cdr"],
                server_listener=self,
                asset_handler=Assets(folder or Path.cwd()).read,
                context=self._context,
            )
        except (RuntimeError, OSError) as fault:
            raise BridgeError(f"port {port} of 127.0.0.1 cannot be served on: {fault}") from None

    @property
    def port(self) -> int:
        """On which it serves."""
        return int(self._server.port)

    def update(self) -> None:
        """Do what clients asked for, and offer what is new in the graph."""
        self._errands.run()
        self._asked.update()
        if self._graph.changes != self._changes:
            self._changes = self._graph.changes
            self._offer_topics()
            if self._control:
                self._offer_services()
            self._tell_connections()
        for topic, endpoint in list(self._undefined.items()):
            self._offer(topic, endpoint)
        self._server.broadcast_time(self._node.now_ns)

    def close(self) -> None:
        """Serve no more. Harmless when repeated."""
        self._server.stop()
        self._graph.close()
        self._node.destroy()

    def _offer_topics(self) -> None:
        found = {
            e.name: e for e in reversed(self._graph.endpoints) if e.kind == "MP" and not is_hidden(e.name)
        }
        for topic in self._channels.keys() - found.keys():
            self._channels.pop(topic)[1].close()
            self._hear(topic)
        self._undefined = {}
        for topic, endpoint in sorted(found.items()):
            self._offer(topic, endpoint)

    def _offer(self, topic: str, endpoint: EndpointInfo) -> None:
        """Make a topic's channel, once its type is known."""
        if topic in self._channels and self._channels[topic][0] == endpoint.type:
            self._undefined.pop(topic, None)
            return
        text = self._definition(endpoint)
        if not text:
            self._undefined[topic] = endpoint
            return
        self._undefined.pop(topic, None)
        if topic in self._channels:
            self._channels.pop(topic)[1].close()
        schema = self._sdk.Schema(name=endpoint.type, encoding="ros2msg", data=text.encode())
        channel = self._sdk.Channel(topic, message_encoding="cdr", schema=schema, context=self._context)
        self._channels[topic] = (endpoint.type, channel)

    def _definition(self, endpoint: EndpointInfo) -> str:
        try:
            return definition(endpoint.type)
        except BridgeError:
            self._asked.ask([endpoint])
            return self._asked.text(Kind(endpoint.type, endpoint.type_hash))

    def _hear(self, topic: str) -> None:
        """Listen while somebody has subscribed; anew for who comes later, because of latched messages."""
        if topic in self._heard:
            self._heard.pop(topic).destroy()
        if self._clients[topic] > 0 and topic in self._channels:
            self._heard[topic] = RawSubscription(self._node, topic, self._pass_on, _HISTORY)

    def _pass_on(self, sample: RawSample) -> None:
        kind, channel = self._channels.get(sample.topic, ("", None))
        if channel is not None and sample.type == kind:
            channel.log(sample.payload, log_time=self._node.now_ns)

    def _offer_services(self) -> None:
        offered = {
            name: kinds[0]
            for name, kinds in self._graph.services().items()
            if not is_hidden(name) and not kinds[0].startswith(_OF_TOOLS)
        }
        gone = [name for name, kind in self._services.items() if offered.get(name) != kind]
        self._server.remove_services(gone)
        for name in gone:
            del self._services[name]
        for name in sorted(offered.keys() - self._services.keys()):
            service = self._service(name, offered[name])
            if service is not None:
                self._server.add_services([service])
                self._services[name] = offered[name]

    def _service(self, name: str, typename: str) -> Any:
        """Return a service for the SDK; None: its type is not known here."""

        def schema(part: str) -> Any:
            text = definition(f"{typename}_{part}").encode()
            told = self._sdk.Schema(name=f"{typename}_{part}", encoding="ros2msg", data=text)
            return self._sdk.MessageSchema(encoding="cdr", schema=told)

        try:
            whole = self._sdk.ServiceSchema(typename, request=schema("Request"), response=schema("Response"))
        except BridgeError:
            return None
        return self._sdk.Service(name, schema=whole, handler=partial(self._serve, name, typename))

    def _serve(self, name: str, typename: str, request: Any) -> bytes:
        """Answer a client; in a thread of the SDK, which tells it what is raised."""
        try:
            asked: Any = codec(f"{typename}_Request").decode(request.payload)
        except Exception:
            raise BridgeError(f"{name}: the request is no {typename}_Request in CDR") from None
        answer = self._errands.call(name, typename, asked)
        return codec(f"{typename}_Response").encode(answer)

    def _tell_connections(self) -> None:
        graph = self._sdk.ConnectionGraph()
        by_kind: dict[str, dict[str, set[str]]] = {"MP": {}, "MS": {}, "SS": {}}
        for each in self._graph.endpoints:
            if each.kind in by_kind and not is_hidden(each.name):
                by_kind[each.kind].setdefault(each.name, set()).add(each.node.full_name)
        for kind, tell in (
            ("MP", graph.set_published_topic),
            ("MS", graph.set_subscribed_topic),
            ("SS", graph.set_advertised_service),
        ):
            for name, nodes in by_kind[kind].items():
                tell(name, sorted(nodes))
        self._server.publish_connection_graph(graph)

    # What the SDK calls, in threads of its own.

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Begin to listen."""
        self._errands.do(partial(self._count, channel.topic, 1))

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """Listen no more, after the last one."""
        self._errands.do(partial(self._count, channel.topic, -1))

    def _count(self, topic: str, change: int) -> None:
        self._clients[topic] += change
        if change > 0 or self._clients[topic] <= 0:
            self._hear(topic)

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Offer a client's topic."""

        def offer() -> None:
            try:
                type_hash = types.rihs01(channel.schema_name)
                publisher = RawPublisher(
                    self._node,
                    self._node.resolve_name(channel.topic),
                    channel.schema_name,
                    type_hash,
                    QoS(depth=10),
                )
            except BridgeError as fault:
                self._server.publish_status(f"{channel.topic}: {fault}", self._sdk.StatusLevel.Error)
            else:
                self._said[client.id, channel.id] = publisher

        self._errands.do(offer)

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Offer it no more."""

        def withdraw() -> None:
            publisher = self._said.pop((client.id, client_channel_id), None)
            if publisher is not None:
                publisher.destroy()

        self._errands.do(withdraw)

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Publish for a client what is a message of its type."""

        def publish() -> None:
            publisher = self._said.get((client.id, client_channel_id))
            if publisher is None:
                return
            try:
                codec(publisher.type).decode(data)
            except Exception:
                told = f"{publisher.name}: {len(data)} bytes are no {publisher.type} in CDR"
                self._server.publish_status(told, self._sdk.StatusLevel.Error)
            else:
                publisher.publish(data)

        self._errands.do(publish)

    def on_get_parameters(self, client: Client, names: list[str], request_id: str | None = None) -> list[Any]:
        """Return values, of all parameters if none is named."""
        nodes = sorted({node.full_name for node in self._graph.nodes if not is_hidden(node.full_name)})
        found = self._parameters.get([node for node in nodes if node != self._own], names)
        return [self._sdk.Parameter(name, value=value) for name, value in found.items()]

    def on_set_parameters(
        self, client: Client, values: list[Any], request_id: str | None = None
    ) -> list[Any]:
        """Set parameters if clients may, and return what they are then."""
        wanted = {each.name: each.get_value() for each in values}
        if self._control:
            try:
                self._parameters.set(wanted)
            except BridgeError as fault:
                self._server.publish_status(str(fault), self._sdk.StatusLevel.Error)
        else:
            told = "parameters are shown, not set: start twin foxglove with --control"
            self._server.publish_status(told, self._sdk.StatusLevel.Warning)
        return self.on_get_parameters(client, sorted(wanted))
