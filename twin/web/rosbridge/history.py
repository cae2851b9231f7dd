"""A bag instead of a graph: what it says at a time, as time goes on, and as it was at another."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any

from twin.bridge import types
from twin.bridge.bags.definitions import complete, learn
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.reader import BagReader
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import TFMessage, new, ns, stamp
from twin.bridge.qos import LATCHED
from twin.bridge.tools.unknown_types import is_known
from twin.bridge.topics.raw import RawSample
from twin.bridge.topics.raw_publisher import Presence
from twin.bridge.types import ServiceType
from twin.bridge.wire.keys import Attachment
from twin.errors import BridgeError, RecordingError, TwinError
from twin.web.rosbridge.access import EVERYTHING, ROLES, Role
from twin.web.rosbridge.past_values import past_values

NAME = "/twin/history"
"""Of the topic that tells where the bag stands."""
PAST = "/twin/past_values"
"""Of the service that tells what numbers were before."""
_PLAYER = "/rosbag2_player"
_NS = 1_000_000_000
_TOLD_S = 0.25
_TF, _TF_STATIC = "/tf", "/tf_static"
_TF_NS = 10 * _NS
"""How long a transform is good, as in tf2."""
_SEVERAL = 30
"""Messages of a topic of which the last one is not all: lines of a log, updates of a grid."""
_ADDING = ("/rosout", "_updates", "/mission/state", "/diagnostics", _TF_STATIC)
_MOST_AT_ONCE = 2000
"""Messages between two looks at what clients want; a bag that is faster is played slower."""


def watching(role: Role) -> Role:
    """Return what is left of a role where nothing can be commanded: to look, and to go through time."""
    viewer = ROLES["viewer"]
    return Role(
        role.name,
        # That service does not know who asks: it is for those who may hear every topic.
        services=(*viewer.services, f"{_PLAYER}/*", *((PAST,) if role.heard == EVERYTHING else ())),
        not_services=viewer.not_services,
        heard=role.heard,
    )


class History:
    """Node `/rosbag2_player` with rosbag2's services, `seek` among them.

    `/twin/history` tells where it stands; it comes the way of the bag's topics, so that who hears of a jump
    does so before what was at the other time.
    """

    def __init__(self, bag: BagReader, bus: Bus, now_s: Callable[[], float]) -> None:
        """Begin with the first message, and play.

        Raises:
            RecordingError: an empty bag, or one that cannot tell what was at a time.
        """
        if not bag.info.count:
            raise RecordingError(f"{bag.path}: is empty")
        try:
            bag.last({}, bag.info.end_ns)
        except RecordingError as error:
            raise RecordingError(f"{bag.path}: {error}") from None
        self._bag, self._now_s = bag, now_s
        self._node = bus.create_node("rosbag2_player")
        self._topics: dict[str, BagTopic] = {}
        self._heard: dict[str, Callable[[RawSample], None]] = {}
        self._on_jump: Callable[[], None] = lambda: None
        self._type = types.get("twin_msgs/msg/History")
        self._form = codec(self._type)
        self._count = self._jumps = 0
        self._rate, self.paused = 1.0, False
        self._start_ns, self._end_ns = bag.info.start_ns, bag.info.end_ns
        self._wall_s, self._bag_ns = now_s(), self._start_ns
        self._said_ns = self._start_ns
        """Up to here all has been said."""
        self._coming: Iterator[BagMessage] | None = None
        self._next: BagMessage | None = None
        self._told_s = float("-inf")
        for topic in (BagTopic(name=NAME, type=self._form.msgtype), *bag.topics.values()):
            self._offer(topic)
        self._offer_services()

    @property
    def is_waiting(self) -> bool:
        """Whether the bag's time goes on."""
        return not self.paused

    @property
    def now_ns(self) -> int:
        """The bag's time [ns]."""
        gone_s = 0.0 if self.paused else self._now_s() - self._wall_s
        return min(self._end_ns, self._bag_ns + int(gone_s * self._rate * _NS))

    def has(self, topic: str) -> bool:
        """Whether a topic is the bag's."""
        return topic in self._topics

    def hear(self, topic: str, take: Callable[[RawSample], None]) -> None:
        """Pass a topic on from now on."""
        self._heard[topic] = take
        self._coming = None

    def leave(self, topic: str) -> None:
        """Pass a topic on no more. Harmless when repeated."""
        if self._heard.pop(topic, None) is not None:
            self._coming = None

    def on_jump(self, forget: Callable[[], None]) -> None:
        """Set what is called before what was at another time is said."""
        self._on_jump = forget

    def state(self, topics: Collection[str]) -> list[RawSample]:
        """Return what topics said last: what somebody knew at this time."""
        until_ns = self._said_ns
        own = [self._sample(self._told())] if NAME in topics else []
        topics = [name for name in topics if name != NAME]
        counts = {name: _SEVERAL if name.endswith(_ADDING) else 1 for name in topics if name != _TF}
        found = self._bag.last(counts, until_ns)
        if _TF in topics:
            found += [*self._bag.last({_TF: 1}, until_ns - _TF_NS)]
            found += [*self._bag.messages([_TF], max(0, until_ns - _TF_NS), until_ns)]
        for name in (_TF, _TF_STATIC):
            of_it = [message for message in found if message.topic == name]
            if len(of_it) > 1:
                found = [message for message in found if message.topic != name]
                found.append(of_it[-1]._replace(data=_newest_transforms(of_it)))
        return own + [self._sample(message) for message in found]

    def update(self) -> None:
        """Say what is due, tell where the bag stands."""
        said = 0
        while not self.paused:
            if self._coming is None:
                heard = [name for name in self._heard if name != NAME]
                self._coming = self._bag.messages(heard, self._said_ns + 1, self._end_ns)
                self._next = next(self._coming, None)
            if self._next is None or self._next.log_ns > self.now_ns:
                self._said_ns = max(self._said_ns, self.now_ns)
                break
            if said >= _MOST_AT_ONCE and self._next.log_ns > self._said_ns:  # those of one time go together
                self._anchor(self._said_ns)
                break
            said += 1
            message, self._said_ns = self._next, self._next.log_ns
            self._next = next(self._coming, None)
            self._heard[message.topic](self._sample(message))
        if not self.paused and self._said_ns >= self._end_ns:
            self.pause()
        if not self.paused and self._now_s() - self._told_s > _TOLD_S:
            self._tell()

    def pause(self) -> None:
        """Stop the bag's time."""
        self._anchor(self.now_ns)
        self.paused = True
        self._tell()

    def resume(self) -> None:
        """Let the bag's time go on; from its end, begin again."""
        if self.now_ns >= self._end_ns:
            self.seek(self._start_ns)
        self._anchor(self.now_ns)
        self.paused = False
        self._tell()

    def set_rate(self, rate: float) -> bool:
        """Change the speed; return whether it is valid."""
        if not 0.0 < rate <= 1000.0:
            return False
        self._anchor(self.now_ns)
        self._rate = rate
        self._tell()
        return True

    def seek(self, time_ns: int) -> bool:
        """Go to another time, and say what was last before it; return whether the bag has it."""
        if not self._start_ns <= time_ns <= self._end_ns:
            return False
        self._anchor(time_ns)
        self._said_ns, self._coming, self._jumps = time_ns, None, self._jumps + 1
        self._tell()
        self._on_jump()
        for sample in self.state([name for name in self._heard if name != NAME]):
            self._heard[sample.topic](sample)
        return True

    def _anchor(self, bag_ns: int) -> None:
        self._wall_s, self._bag_ns = self._now_s(), bag_ns

    def _offer(self, topic: BagTopic) -> None:
        if topic.name in self._topics:
            return
        try:
            if topic.definition and topic.definition_format == "ros2msg":
                learn(topic.type, topic.definition)
            known = complete(topic)
        except BridgeError:
            return
        if known.type_hash and is_known(known.type):
            self._topics[topic.name] = known
            Presence(self._node, "MP", topic.name, known.type, known.type_hash, LATCHED)

    def _sample(self, message: BagMessage) -> RawSample:
        self._count += 1
        topic = self._topics[message.topic]
        source = Attachment(self._count, message.publish_ns, bytes(16))
        return RawSample(message.topic, topic.type, topic.type_hash, message.data, source)

    def _tell(self) -> None:
        self._told_s = self._now_s()
        if NAME in self._heard:
            self._heard[NAME](self._sample(self._told()))

    def _told(self) -> BagMessage:
        now_ns = self.now_ns
        times = (stamp(time_ns) for time_ns in (self._start_ns, self._end_ns, now_ns))
        state = self._type(*times, self._rate, self.paused, self._jumps)
        return BagMessage(NAME, self._form.encode(state), now_ns, now_ns)

    def _offer_services(self) -> None:
        answers: Mapping[str, Callable[[Any], dict[str, Any] | None]] = {
            "Pause": lambda request: self.pause(),
            "Resume": lambda request: self.resume(),
            "TogglePaused": lambda request: self.resume() if self.paused else self.pause(),
            "IsPaused": lambda request: {"paused": self.paused},
            "SetRate": lambda request: {"success": self.set_rate(request.rate)},
            "GetRate": lambda request: {"rate": self._rate},
            "Seek": lambda request: {"success": self.seek(ns(request.time))},
        }
        names = ("pause", "resume", "toggle_paused", "is_paused", "set_rate", "get_rate", "seek")
        for name, (kind, answer) in zip(names, answers.items(), strict=True):
            service = ServiceType(f"rosbag2_interfaces/srv/{kind}")
            self._node.create_service(service, f"~/{name}", _responding(service, answer))
        service = ServiceType("twin_msgs/srv/PastValues")
        self._node.create_service(service, PAST, _responding(service, self._past_values))

    def _past_values(self, request: Any) -> dict[str, Any]:
        if request.topic == NAME or request.topic not in self._topics:
            return {"message": f"the bag has no topic {request.topic[:80]!r}"}
        asked = request.topic, self._topics[request.topic].type, request.field, request.seconds, request.every
        try:
            times, values = past_values(self._bag, *asked, self._said_ns)
        except TwinError as error:
            return {"message": str(error)}
        return {"success": True, "times": times, "values": values}


def _responding(service: ServiceType, answer: Callable[[Any], dict[str, Any] | None]) -> Callable[[Any], Any]:
    return lambda request: new(service.Response, **(answer(request) or {}))


def _newest_transforms(messages: list[BagMessage]) -> bytes:
    """Return one message with the newest transform of each frame."""
    form = codec(TFMessage)
    newest: dict[str, Any] = {}
    for message in messages:
        try:
            newest |= {each.child_frame_id: each for each in form.decode(message.data).transforms}
        except Exception:  # bytes that are none: who hears them is told by itself
            continue
    return form.encode(TFMessage(list(newest.values())))
