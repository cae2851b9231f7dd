"""A mirror beside a plant of the same process, without a network: a tick of one, then one of the other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any, Self

from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import TFMessage, Twist, Vector3
from twin.bridge.qos import LATCHED, as_qos
from twin.bridge.wire.session import SessionConfig
from twin.geometry import Pose2
from twin.live.futures import Futures, WhatIf
from twin.live.futures.futures import Answer
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.mirror import Mirror
from twin.live.mirror.source import ClockReading, Source
from twin.live.plant import Plant
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario

_START_NS = 1_700_000_000_000_000_000
_LATE_TICKS = 3
"""So much later messages arrive, on both ways."""
_BEFORE, _STOPPING = 130, 30
"""Ticks that the plant has driven before, and those of them in which it comes to rest."""
_WRONG = Pose2(0.05, 0.05, 0.1)
"""How wrong it is where the mirror begins."""
_NOT_CARRIED = ("/rosout", "/parameter_events", "/robot_description", "/tf_static", "/cmd_vel")


class PlantSource(Source):
    """A plant that ticks after the mirror, and what the two tell each other."""

    is_live = True

    def __init__(self, plant: Plant, network: SessionConfig | None) -> None:
        self.plant, self.network = plant, network
        self.commands: list[tuple[int, Any]] = []
        """What the mirror has told the plant, and when [ns]."""
        self._heard: deque[tuple[int, Any]] = deque()
        self._told: deque[tuple[int, Any]] = deque()
        self._publishers: dict[str, Any] = {}
        self._ticks = 0
        bus = plant.run.run.bus
        node = bus.create_node("somebody")
        self._cmd_vel = node.create_publisher(Twist, "/cmd_vel", 10)
        bus.tap(self._on_said)
        # What was said before that.
        node.create_subscription(TFMessage, "/tf_static", self._on_static, LATCHED)

    @property
    def start_ns(self) -> int:
        return self.plant.clock.now_ns

    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        self._clock = clock
        self._node = run.run.bus.create_node("driver")
        run.run.bus.tap(self._on_commanded)

    def drive(self, ticks: int) -> None:
        """Let the plant drive a curve, unmirrored, and stop: its odometry does not begin where it is then."""
        for tick in range(ticks):
            moves = tick < ticks - _STOPPING
            self._cmd_vel.publish(
                Twist(Vector3(0.3 if moves else 0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.4 if moves else 0.0))
            )
            self.plant.advance(lambda: True)
        self._heard = deque((0, sample) for _, sample in self._heard if sample.topic == "/tf_static")

    def reading(self, robot: str) -> ClockReading:
        period_s = self.plant.run.run.parts.control_period_ns * 1e-9
        return ClockReading(offset_s=0.0, bound_s=(_LATE_TICKS - 1) * period_s)

    def after_tick(self) -> tuple[()]:
        self._ticks += 1
        while self._told and self._told[0][0] <= self._ticks:
            self._cmd_vel.publish(self._told.popleft()[1])
        self.plant.advance(lambda: True)
        self._clock.follow(self.plant.clock.now_ns, 0)
        while self._heard and self._heard[0][0] <= self._ticks:
            sample = self._heard.popleft()[1]
            if sample.topic not in self._publishers:
                qos = LATCHED if sample.topic.endswith("/tf_static") else as_qos(10)
                kind = codec(sample.msgtype).cls
                self._publishers[sample.topic] = self._node.create_publisher(kind, sample.topic, qos)
            self._publishers[sample.topic].publish(sample.message, frozen=True)
        return ()

    def close(self) -> None:
        self.plant.close()

    def _on_said(self, sample: Any) -> None:
        if sample.topic not in _NOT_CARRIED:
            self._heard.append((self._ticks + _LATE_TICKS, sample))

    def _on_static(self, message: TFMessage) -> None:
        sample = SimpleNamespace(topic="/tf_static", msgtype=codec(TFMessage).msgtype, message=message)
        self._heard.append((self._ticks + _LATE_TICKS, sample))

    def _on_commanded(self, sample: Any) -> None:
        if sample.topic == "/cmd_vel":
            self.commands.append((sample.time_ns, sample.message))
            self._told.append((self._ticks + _LATE_TICKS, sample.message))


class Beside:
    """A plant that has been under way for a while, and its mirror."""

    def __init__(
        self,
        scenario: Callable[[Pose2], Scenario],
        start: Pose2,
        *,
        network: SessionConfig | None = None,
        **options: Any,
    ) -> None:
        with ExitStack() as ending:
            self.plant = Plant(scenario(start), network=SessionConfig(), pace=None, start_ns=_START_NS)
            ending.callback(self.plant.close)
            self.source = PlantSource(self.plant, network)
            self.source.drive(_BEFORE)
            guess = self.pose(self.plant.run) @ _WRONG
            self.mirror = ending.enter_context(Mirror(scenario(guess), self.source, **options))
            self._ending = ending.pop_all()
        self.run = self.mirror.run

    @property
    def now_s(self) -> float:
        """Simulated time of the mirror."""
        return self.run.run.world.time_ns * 1e-9

    def until(self, time_s: float) -> None:
        """Go on to a time [s]."""
        if self.now_s < time_s - 1e-9:
            self.mirror.advance(lambda: self.now_s >= time_s - 1e-9)

    def answer(self, **asked: Any) -> Answer:
        """Return what becomes of it."""
        with Futures(self.run, WhatIf(**asked)) as futures:
            return futures.wait()

    @property
    def digest(self) -> str:
        """Of what the mirror has said and been so far."""
        return self.run.digest.finish(self.run.run.world.state_digest())

    def pose(self, run: OpenRun) -> Pose2:
        """Return where the robot truly is."""
        world = run.run.world
        (robot,) = world.robots.values()
        return world.pose(robot.base).to_pose2()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.close()
