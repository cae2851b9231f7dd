"""Recording what is needed of a robot that is on the graph, while somebody else commands it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

from twin.bridge.bags.recorder import Recorder
from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.msgs import Odometry
from twin.bridge.qos import SENSOR_DATA
from twin.errors import RecordingError, nearest
from twin.live.calibration.calibrate import LEAST_S
from twin.live.calibration.excitation import Excitation
from twin.live.calibration.recorded import COMMAND, JOINTS, ODOM, SCAN

PATIENCE_S = 20.0
"""For the first message on each topic that is needed, but commands."""
_SILENT_S = 2.0
_SPOKEN = (JOINTS, ODOM, SCAN)


class Listening:
    """Lasts until the robot was heard for long enough; call `update` after every spin of the bus."""

    def __init__(self, bus: Bus, names: Mapping[str, str], recorder: Recorder, seconds: float) -> None:
        """Begin to listen; nothing is ever said.

        Args:
            bus: The robot is on its graph.
            names: Topics, by what they are; see `topics_of`.
            recorder: Of these topics; it is closed with this.
            seconds: How long it lasts, from when the robot is heard [s].
        """
        self.seconds, self.excitation = seconds, Excitation()
        self._bus, self._names, self._recorder = bus, names, recorder
        self._node = bus.create_node("calibration")
        self._node.create_subscription(Odometry, names[ODOM], self._on_odometry, SENSOR_DATA, frozen=True)
        self._started_ns = self._node.now_ns
        self._first_ns: int | None = None
        self._latest_ns = 0

    @property
    def heard_s(self) -> float:
        """For how long the robot has been heard [s]."""
        return 0.0 if self._first_ns is None else (self._node.now_ns - self._first_ns) * 1e-9

    @property
    def is_over(self) -> bool:
        """Whether it has listened for long enough."""
        return self._first_ns is not None and self.heard_s >= self.seconds

    @property
    def lacks(self) -> str:
        """What is still missing, in words; empty: nothing."""
        if missing := self._missing:
            return f"nothing came on {_listed(missing)} yet"
        if self._node.now_ns - self._latest_ns > _SILENT_S * 1e9:
            return "the robot is silent"
        if not self._recorder.counts[self._names[COMMAND]]:
            return f"nobody has commanded the robot on {self._names[COMMAND]} yet"
        lacking = self.excitation.lacking
        if lacking:
            return f"the robot has not {_listed(lacking, 'or')} enough yet"
        return f"{LEAST_S:g} s are needed" if self.heard_s < LEAST_S else ""

    def update(self) -> None:
        """Write what has come.

        Raises:
            RecordingError: The robot is not there, or says too little; the disk is full or gone.
        """
        self._recorder.update()
        if self._first_ns is None:
            if not self._missing:
                self._first_ns = self._node.now_ns
            elif self._node.now_ns - self._started_ns > PATIENCE_S * 1e9:
                raise self._trouble()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Finish the bag; raises RecordingError if a topic that is needed is not in it."""
        self._recorder.close()
        self._node.destroy()
        if kind is None and (self._missing or not self._recorder.counts[self._names[COMMAND]]):
            raise self._trouble()

    @property
    def _missing(self) -> list[str]:
        return [self._names[key] for key in _SPOKEN if not self._recorder.counts[self._names[key]]]

    def _trouble(self) -> RecordingError:
        waited_s = (self._node.now_ns - self._started_ns) * 1e-9
        missing = self._missing or [self._names[COMMAND]]
        there = {each.name for each in Graph.snapshot(self._bus).endpoints if each.kind == "MP"}
        others = there - set(missing) - {"/rosout", "/parameter_events"}
        known = nearest(missing[0], others) if others else "nobody publishes anything else"
        return RecordingError(f"nothing came on {_listed(missing)} in {waited_s:.0f} s; {known}")

    def _on_odometry(self, message: Odometry) -> None:
        self._latest_ns = self._node.now_ns
        twist = message.twist.twist
        self.excitation.put(self._latest_ns * 1e-9, twist.linear.x, twist.angular.z)


def _listed(words: list[str] | tuple[str, ...], last: str = "and") -> str:
    """Return words as in a sentence: 'a, b and c'."""
    *rest, end = words
    return f"{', '.join(rest)} {last} {end}" if rest else end
