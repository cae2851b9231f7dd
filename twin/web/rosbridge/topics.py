"""Topics of the graph for clients: each is heard once and offered once, however many clients there are."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from twin.bridge import types
from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.graph import Graph
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.tools.unknown_types import is_known
from twin.bridge.topics import Publisher
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.topics.raw_publisher import Presence
from twin.errors import BridgeError
from twin.web.rosbridge.flow import Crowd, Flow, Wanted, Watch
from twin.web.rosbridge.frames import Frame, Heard, Send
from twin.web.rosbridge.history import History
from twin.web.rosbridge.learner import Learner, type_name
from twin.web.rosbridge.values import to_message

if TYPE_CHECKING:
    from twin.web.rosbridge.session import Session

_DEPTH = 1000
_RETAINED = 64
"""Latched messages of a publisher that are kept for clients that come later, at most."""
_MOST_PUBLISHERS = 256
"""Publishers of a topic whose latched messages are kept."""
_KEEP_S = 10.0
"""How long a publisher outlives its last client [s]; a page that is loaded again finds it there."""
_MEET_S = 0.5
"""How long a new publisher's messages wait for subscriptions that the graph has already [s]."""


class Source:
    """A topic that clients hear."""

    def __init__(
        self,
        node: Node,
        graph: Graph,
        topic: str,
        given: str | None,
        learner: Learner,
        now_s: Callable[[], float],
        history: History | None,
        topics: Topics,
    ) -> None:
        self._topics = topics
        self._history = history if history is not None and history.has(topic) else None
        self.flows: dict[Hashable, Flow] = {}
        self._graph, self._topic, self._learner, self._now_s = graph, topic, learner, now_s
        self._codecs: dict[tuple[str, str], Codec[Any] | None] = {}
        self._retained: OrderedDict[bytes, deque[Heard]] = OrderedDict()
        self._endpoints: list[Presence | RawSubscription] = []
        self._crowds: tuple[Crowd, ...] = ()
        self._others: tuple[Flow, ...] | None = None
        """Flows that belong to no crowd; None: who is in which is to be found anew."""
        if self._history is not None:
            self._history.hear(topic, self._on_sample)
            return
        publishers = graph.publishers(topic)
        latched = not publishers or any(p.qos.durability == "transient_local" for p in publishers)
        qos = QoS(depth=_DEPTH, durability="transient_local" if latched else "volatile")
        typename = publishers[0].type if publishers else given
        if typename is not None and is_known(typename):
            self._endpoints.append(Presence(node, "MS", topic, typename, types.rihs01(typename), qos))
        self._endpoints.append(RawSubscription(node, topic, self._on_sample, qos))

    def join(self, who: Hashable, flow: Flow) -> None:
        """Let somebody hear the topic, first what was latched."""
        self.flows[who] = flow
        self._others = None
        if self._history is not None:
            for sample in self._history.state([self._topic]):
                flow.offer(Heard(sample, self._codec(sample)), self._now_s())
        for kept in self._retained.values():
            for heard in kept:
                flow.offer(heard, self._now_s())

    def destroy(self) -> None:
        """Hear nothing any more."""
        if self._history is not None:
            self._history.leave(self._topic)
        for endpoint in self._endpoints:
            endpoint.node.destroy_subscription(endpoint)  # type: ignore[arg-type]

    def _on_sample(self, sample: RawSample) -> None:
        self._topics.urgent()
        heard = Heard(sample, self._codec(sample))
        if self._history is None:
            self._retain(sample, heard)
        if self._others is None:
            self._sort()
        for crowd in self._crowds:
            crowd.offer(heard)
        now_s = self._now_s()
        for flow in self._others or ():
            flow.offer(heard, now_s)

    def sort_anew(self) -> None:
        """Take note that somebody came, went, or wants the topic in another way."""
        self._crowds, self._others = (), None

    def _sort(self) -> None:
        alike: dict[Any, list[Session]] = {}
        for who, flow in self.flows.items():
            if flow.at_once is not None:  # so it is no Watch, and of a session
                alike.setdefault(flow.at_once, []).append(cast("Session", who))
        self._crowds = tuple(
            Crowd(self._topic, [self.flows[who] for who in sessions], self._topics.together(sessions))
            for sessions in alike.values()
        )
        self._others = tuple(flow for flow in self.flows.values() if flow.at_once is None)

    def _codec(self, sample: RawSample) -> Codec[Any] | None:
        key = sample.type, sample.type_hash
        found = self._codecs.get(key)
        if found is None and is_known(sample.type):
            found = self._codecs[key] = codec(types.get(sample.type))
        elif found is None:
            self._learner.ask(self._graph.publishers(self._topic), self._now_s())
        return found

    def _retain(self, sample: RawSample, heard: Heard) -> None:
        gid = sample.source.gid
        if gid not in self._retained:
            qos = next((p.qos for p in self._graph.publishers(self._topic) if p.gid == gid), None)
            if qos is None:
                return
            # Of others nothing is kept; that they are none is, as to ask the graph for every message is dear.
            most = min(qos.depth, _RETAINED) if qos.durability == "transient_local" else 0
            self._retained[gid] = deque(maxlen=most)
            if len(self._retained) > _MOST_PUBLISHERS:
                self._retained.popitem(last=False)
        self._retained[gid].append(heard)


@dataclass
class _Outlet:
    """A topic that clients publish."""

    publisher: Publisher[Any]
    since_s: float
    owners: dict[Session, set[str | None]] = field(default_factory=dict)
    held: deque[Any] = field(default_factory=lambda: deque(maxlen=100))
    left_s: float = 0.0
    """When its last owner left."""


def one_by_one(sessions: Sequence[Session]) -> Send:
    """Return what sends a frame to each of these."""

    def send(frame: Frame, topic: str | None) -> None:
        for session in sessions:
            session.send(frame, topic)

    return send


class Topics:
    """All that clients hear and publish."""

    def __init__(
        self,
        node: Node,
        graph: Graph,
        learner: Learner,
        now_s: Callable[[], float],
        history: History | None = None,
    ) -> None:
        self._node, self._graph, self._learner, self._now_s = node, graph, learner, now_s
        self._history = history
        if history is not None:
            history.on_jump(self._forget)
        self.urgent: Callable[[], None] = lambda: None
        """Called before each message of the graph: what cannot wait until all that came are passed on."""
        self.together = one_by_one
        """Returns what sends a frame to several sessions."""
        self._sources: dict[str, Source] = {}
        self._outlets: dict[str, _Outlet] = {}
        self._late: dict[Flow, None] = {}
        """In which something waits for its time."""

    @property
    def is_waiting(self) -> bool:
        """Whether `update` has something to do soon."""
        return bool(self._late) or any(outlet.held for outlet in self._outlets.values())

    def subscribe(
        self, session: Session, name: str, given: str | None, key: str | None, wanted: Wanted
    ) -> None:
        """Let a client hear a topic.

        Raises:
            BridgeError: an invalid name, or the graph has another type than the client says.
        """
        topic = self._node.resolve_name(name)
        expected = None if given is None else type_name(given, "msg")
        self._check(topic, expected)
        source = self._source(topic, expected)
        flow = source.flows.get(session)
        is_new = flow is None
        if flow is None:
            flow = Flow(topic, session.send, lambda told: session.status("error", told, key))
            flow.late = self._late
        flow.want(key, wanted)
        flow.type = expected or flow.type
        source.sort_anew()
        if is_new:
            source.join(session, flow)

    def unsubscribe(self, session: Session, name: str, key: str | None) -> None:
        """End one subscription of a client to a topic, or all if there is no id; none is no fault."""
        topic = self._node.resolve_name(name)
        source = self._sources.get(topic)
        flow = source.flows.get(session) if source else None
        if source is None or flow is None:
            return
        if flow.unwant(key):
            self.unwatch(session, topic)
        else:
            source.sort_anew()

    def watch(
        self,
        who: Hashable,
        topic: str,
        take: Callable[[Heard], None],
        expected: str | None = None,
        forget: Callable[[], None] = lambda: None,
    ) -> None:
        """Let somebody who is no client hear a topic, by its absolute name, message by message.

        Args:
            who: To end it by.
            topic: Its name.
            take: Takes a message.
            expected: Type, if nobody tells it yet.
            forget: Called when what was heard is over: a bag goes to another time.
        """
        self._source(topic, expected).join(who, Watch(take, forget))

    def _forget(self) -> None:
        for source in self._sources.values():
            for flow in source.flows.values():
                flow.forget()

    def unwatch(self, who: Hashable, topic: str) -> None:
        """End what somebody hears of a topic; a topic that nobody hears any more is left."""
        source = self._sources.get(topic)
        flow = None if source is None else source.flows.pop(who, None)
        if source is None or flow is None:
            return
        self._late.pop(flow, None)
        source.sort_anew()
        if not source.flows:
            self._sources.pop(topic).destroy()

    def _source(self, topic: str, expected: str | None) -> Source:
        if topic not in self._sources:
            self._sources[topic] = Source(
                self._node,
                self._graph,
                topic,
                expected,
                self._learner,
                self._now_s,
                self._history,
                self,
            )
        return self._sources[topic]

    def count(self, session: Session) -> int:
        """Return how many topics a client hears and publishes."""
        heard = sum(session in source.flows for source in self._sources.values())
        return heard + sum(session in outlet.owners for outlet in self._outlets.values())

    def advertise(
        self,
        session: Session,
        name: str,
        given: str,
        key: str | None,
        *,
        latch: bool = False,
        depth: int = 10,
    ) -> None:
        """Let a client publish a topic.

        Raises:
            BridgeError: an invalid name, an unknown type, or the topic has another.
        """
        topic, typename = self._node.resolve_name(name), type_name(given, "msg")
        outlet = self._outlets.get(topic)
        if outlet is None or outlet.publisher.msgtype != typename:
            self._check(topic, typename)
            if not is_known(typename):
                self._learner.ask(self._graph.publishers(topic), self._now_s())
                self._learner.ask(self._graph.subscriptions(topic), self._now_s())
            cls = types.get(typename)
            if outlet is not None:
                self._node.destroy_publisher(outlet.publisher)
            qos = LATCHED if latch else QoS(depth=min(max(depth, 1), _DEPTH))
            outlet = _Outlet(self._node.create_publisher(cls, topic, qos), self._now_s())
            self._outlets[topic] = outlet
        outlet.owners.setdefault(session, set()).add(key)

    def unadvertise(self, session: Session, name: str, key: str | None) -> None:
        """End a client's publishing.

        Raises:
            BridgeError: it has not advertised the topic.
        """
        topic = self._node.resolve_name(name)
        outlet = self._outlets.get(topic)
        if outlet is None or session not in outlet.owners:
            raise BridgeError(f"{topic} is not advertised by this client")
        keys = outlet.owners[session]
        keys.discard(key)
        if key is None or not keys:
            del outlet.owners[session]
            outlet.left_s = self._now_s()

    def type_of(self, name: str) -> str | None:
        """Return the type of what is published, or of a topic of the graph; None if nobody knows."""
        topic = self._node.resolve_name(name)
        if topic in self._outlets:
            return self._outlets[topic].publisher.msgtype
        ends = self._graph.subscriptions(topic) or self._graph.publishers(topic)
        return ends[0].type if ends else None

    def publish(
        self, session: Session, name: str, values: Any, *, latch: bool = False, is_finite: bool = False
    ) -> Any:
        """Publish for a client, and return the message.

        What it has not advertised is advertised if the graph knows the type.

        Raises:
            BridgeError: no type, or values that the type's fields cannot hold.
        """
        topic = self._node.resolve_name(name)
        outlet = self._outlets.get(topic)
        if outlet is None or session not in outlet.owners:
            typename = self.type_of(topic)
            if typename is None:
                raise BridgeError(f"{topic} has no type yet; valid: advertise it first")
            self.advertise(session, topic, typename, None, latch=latch)
            outlet = self._outlets[topic]
        message = to_message(outlet.publisher.codec.cls, values, self._node.now_ns, is_finite=is_finite)
        self.say(topic, message)
        return message

    def say(self, topic: str, message: Any) -> None:
        """Publish a message on a topic that some client has advertised."""
        outlet = self._outlets[topic]
        young = self._now_s() - outlet.since_s < _MEET_S
        if outlet.held or (
            young and not outlet.publisher.has_subscribers and self._graph.subscriptions(topic)
        ):
            outlet.held.append(message)
        else:
            outlet.publisher.publish(message)

    def leave(self, session: Session) -> None:
        """End all that a client hears and publishes."""
        for topic, source in tuple(self._sources.items()):
            if session in source.flows:
                self.unsubscribe(session, topic, None)
        for topic, outlet in self._outlets.items():
            if session in outlet.owners:
                self.unadvertise(session, topic, None)

    def update(self) -> None:
        """Send what has waited long enough; forget publishers that nobody has needed for a while."""
        now_s = self._now_s()
        for flow in tuple(self._late):
            flow.update(now_s)
        for topic, outlet in tuple(self._outlets.items()):
            if outlet.held and (outlet.publisher.has_subscribers or now_s - outlet.since_s > _MEET_S):
                while outlet.held:
                    outlet.publisher.publish(outlet.held.popleft())
            if not outlet.owners and now_s - outlet.left_s > _KEEP_S:
                self._node.destroy_publisher(self._outlets.pop(topic).publisher)

    def _check(self, topic: str, typename: str | None) -> None:
        found = self._graph.topics().get(topic, ()) if typename is not None else ()
        if typename is not None and found and typename not in found:
            raise BridgeError(f"{topic} has the type {', '.join(found)}, not {typename}")
