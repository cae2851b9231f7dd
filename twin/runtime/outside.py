"""The participants of a run in lock-step."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.lockstep.protocol import admit_questions
from twin.bridge.lockstep.stepper import Attendance, Stepper, await_node
from twin.bridge.lockstep.topic import AnswerConfig, AnswerTopic
from twin.errors import ScenarioError
from twin.scenario.outside import Outside


class Lockstep:
    """The participants of a run in lock-step; nobody else can change it."""

    def __init__(self, bus: Bus, outside: Outside) -> None:
        """Wait until everybody is there.

        Raises:
            BridgeError: somebody does not come in time, or a topic that the run does not have.
            ScenarioError: a wire other than rmw_zenoh's.
        """
        if bus.naming.wire != "rmw_zenoh":
            raise ScenarioError(
                f"--wire {bus.naming.wire}: lock-step speaks rmw_zenoh only; leave --wire out"
            )
        self._bus = bus
        self._tick = 0
        self._attendance = Attendance(bus)
        self._participants: list[Stepper | AnswerTopic] = []
        heard = _heard(bus)
        timeout_s = outside.wait_timeout_s
        try:
            for name in outside.wait_for:
                if "@" in name or name in heard:
                    topic, _, stimulus = name.partition("@")
                    config = AnswerConfig(
                        topic=topic, stimulus=stimulus or _stimulus(bus, topic), timeout_s=timeout_s
                    )
                    self._participants.append(AnswerTopic(bus, config))
                else:
                    self._join(name, timeout_s)
            self._answered = {p.config.topic for p in self._participants if isinstance(p, AnswerTopic)}
            for participant in self._participants:
                if isinstance(participant, AnswerTopic):
                    participant.wait_until_present()
        except BaseException:
            self.close()
            raise

    def admit(self) -> None:
        """Let requests of services that only read in; refuse everything else from outside."""
        if self._bus.link is not None:
            self._bus.link.release()
        admit_questions(self._bus, self._answered)

    def step(self) -> None:
        """Let every participant do what is due in this tick, in the order of the options.

        Raises:
            BridgeError: one does not answer in time, or has gone.
        """
        for participant in self._participants:
            participant.step(self._tick)
        self._tick += 1

    @property
    def surplus(self) -> dict[str, int]:
        """Topics on which more came than was waited for; then the run is not deterministic."""
        topics = [p for p in self._participants if isinstance(p, AnswerTopic) and p.surplus]
        return {topic.config.topic: topic.surplus for topic in topics}

    def _join(self, node: str, timeout_s: float) -> None:
        """Take in the process of a node, unless another of its nodes has brought it already."""
        if any(node in p.nodes for p in self._participants if isinstance(p, Stepper)):
            return
        self._participants.append(await_node(self._bus, self._attendance, node, timeout_s))

    def close(self) -> None:
        """Tell everybody that the run is over. Harmless when repeated."""
        for participant in self._participants:
            participant.close()
        self._participants.clear()
        self._attendance.close()


def _heard(bus: Bus) -> set[str]:
    """Return the topics to which nodes of the run subscribe."""
    endpoints = Graph.snapshot(bus).endpoints
    return {e.name for e in endpoints if e.kind == "MS" and e.node.session_id == bus.session_id}


def _stimulus(bus: Bus, topic: str) -> str:
    """Return what a topic answers if nobody says it: odometry for velocity commands, else the clock."""
    namespace, _, name = topic.rpartition("/")
    odometry = f"{namespace}/odom"
    published = {e.name for e in Graph.snapshot(bus).endpoints if e.kind == "MP"}
    return odometry if name.startswith("cmd_vel") and odometry in published else "/clock"
