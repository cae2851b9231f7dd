"""A network that loses, delays or doubles messages."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated, Any, Literal

from twin.bridge.bus import Bus
from twin.bridge.graph import is_hidden
from twin.bridge.topics import Publisher, Subscription
from twin.bridge.topics.link import Carried, Link, Stage
from twin.errors import nearest
from twin.faults.fault import Effect, Fault, FaultContext, refuse
from twin.parameters import Fraction, NotNegative, Seconds, Share
from twin.scenario.faults import LastingFault
from twin.sim.noise import NoiseStream

_OWN = ("/clock", "/rosout", "/parameter_events")
"""Topics by which a run tells of itself."""
_AS_IT_IS = (0,)


def linked(bus: Bus) -> list[Stage]:
    """Return the stages through which the messages of a bus go."""
    if bus.link is None:
        bus.link = Link(bus.clock)
    return bus.link.stages


class Counted:
    """A stage for some messages, which counts those that somebody hears."""

    def __init__(self, late: Callable[[Carried], Sequence[int]], concerns: Callable[[Carried], bool]) -> None:
        """Take what it does, as a `Stage`, and to which messages."""
        self._late, self._concerns = late, concerns
        self.count = self.changed = self.unheard = 0

    def __call__(self, message: Carried) -> Sequence[int]:
        """Let a message pass."""
        if not self._concerns(message):
            return _AS_IT_IS
        copies = self._late(message)
        if message.is_heard:
            self.count += 1
            self.changed += copies != _AS_IT_IS
        else:
            self.unheard += 1
        return copies

    def told(self, what: str, did: str) -> str:
        """Return how many `what` somebody hears were altered, as a sentence."""
        if self.count == 0 < self.unheard:
            return f"nobody hears these {self.unheard} {what}"
        return f"{self.changed} of {self.count} {what} {did}"


@dataclass(frozen=True, kw_only=True)
class MessageConfig(LastingFault):
    """A fault of the network."""

    topic: str = "*"
    """Which topics; `*` and `?` stand for any letters. With one of these, latched topics, those of actions,
    `/clock`, `/rosout` and `/parameter_events` are left out."""


class MessageFault(Fault):
    """Stands between publishers and those who hear them."""

    did = "lost"
    """What it does to messages, in a word."""

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        super().__init__(name, config, context)
        topic = config.topic
        self._is_pattern = "*" in topic or "?" in topic
        self._pattern = topic if topic.startswith(("/", "*")) else f"/{topic}"
        ends = [end for node in context.bus.nodes for end in node.endpoints]
        topics = {end.name: end for end in ends if isinstance(end, Publisher | Subscription)}
        if not any(self._concerns_topic(end.name, latched=end.is_latched) for end in topics.values()):
            visible = [topic for topic in topics if not is_hidden(topic)]
            raise refuse(
                "topic", f"there is no topic '{self._pattern}'; {nearest(self._pattern, sorted(visible))}"
            )
        self._streams: dict[tuple[str, str], NoiseStream] = {}
        self._stage = Counted(self.copies, lambda m: self._concerns_topic(m.topic, latched=m.is_latched))
        self.text = f"{name} of messages on {self._pattern}"

    @abstractmethod
    def copies(self, message: Carried) -> Sequence[int]:
        """Return how late each copy of a message is [ns], as a `Stage`."""

    def begin(self) -> None:
        """Stand in the way."""
        linked(self.context.bus).append(self._stage)

    def end(self) -> None:
        """Let all pass."""
        linked(self.context.bus).remove(self._stage)

    @property
    def effect(self) -> Effect:
        """How many messages that somebody hears did not arrive once and at once."""
        counted = self._stage
        return Effect(counted.changed > 0, counted.told("messages", self.did))

    @property
    def robots(self) -> frozenset[str]:
        """All: their topics are looked at in one place."""
        return frozenset(self.context.robots)

    def happens(self, message: Carried) -> bool:
        """Return whether a message is one of the `share` to which it happens, each on its own."""
        return bool(self.stream(message).uniform(message.sequence, 1)[0] < self.config.share)

    def stream(self, message: Carried) -> NoiseStream:
        """Return the random numbers for the messages of a publisher, by its count."""
        key = message.topic, message.sender
        if key not in self._streams:
            self._streams[key] = self.noise(" ".join(key))
        return self._streams[key]

    def _concerns_topic(self, topic: str, *, latched: bool) -> bool:
        if not self._is_pattern:
            return topic == self._pattern
        return (
            not latched and topic not in _OWN and not is_hidden(topic) and fnmatchcase(topic, self._pattern)
        )


class Loss(MessageFault):
    """Messages get lost."""

    value = "share"

    @dataclass(frozen=True, kw_only=True)
    class Config(MessageConfig):
        """Messages get lost."""

        share: Annotated[Share, Fraction]
        """Of the messages that get lost, each on its own."""

    def copies(self, message: Carried) -> Sequence[int]:
        """Lose it, or not."""
        return () if self.happens(message) else _AS_IT_IS


class LinkDelay(MessageFault):
    """Messages arrive late."""

    value = "time"
    did = "late"

    @dataclass(frozen=True, kw_only=True)
    class Config(MessageConfig):
        """Messages arrive late."""

        time: Annotated[Seconds, NotNegative]
        """By how much [s]; nodes hear of it at the first control period after that."""
        direction: Literal["both", "in", "out"] = "both"
        """Which messages: what comes from other processes is `in`, what is published here is `out`."""
        jitter: Annotated[Seconds, NotNegative] = 0.0
        """Standard deviation of the delay, which is never negative [s]: messages may pass each other."""

    def copies(self, message: Carried) -> Sequence[int]:
        """Hold it back."""
        if self.config.direction == ("out" if message.sender == "" else "in"):
            return _AS_IT_IS
        late = self.config.time
        if self.config.jitter:
            late += self.config.jitter * float(self.stream(message).normal(message.sequence, 1)[0])
        return (round(max(0.0, late) * 1e9),)


class Duplication(MessageFault):
    """Messages arrive twice."""

    value = "share"
    did = "doubled"

    @dataclass(frozen=True, kw_only=True)
    class Config(MessageConfig):
        """Messages arrive twice."""

        share: Annotated[Share, Fraction]
        """Of the messages that arrive twice, each on its own."""
        time: Annotated[Seconds, NotNegative] = 0.0
        """How long after the first the second arrives [s]."""

    def copies(self, message: Carried) -> Sequence[int]:
        """Double it, or not."""
        return (0, round(self.config.time * 1e9)) if self.happens(message) else _AS_IT_IS
