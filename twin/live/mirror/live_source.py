"""Physical robots on a ROS graph, now."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from twin.bridge.graph import Graph
from twin.bridge.msgs import ns
from twin.live.mirror.exchanges import ClockExchanges
from twin.live.mirror.least_delay import LeastDelay
from twin.live.mirror.robot_clocks import RobotClocks
from twin.live.mirror.source import ClockChange, ClockReading, Source
from twin.runtime.pacing import Pace

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig
    from twin.live.mirror.followed_clock import FollowedClock
    from twin.runtime.open_run import OpenRun

_SLACK_S = 1.0
"""The mirror makes up for what it is behind: the physical robots do not wait."""
_MEETING_S = 2.0
_FIRST_ANSWERS = 5
_LOOK_S = 0.02
_PATIENCE_NS = 3_000_000_000
"""A robot that has not answered for so long is followed by its fastest messages."""


class LiveSource(Source):
    """The graph; a robot's clock is known from what its nodes answer, or say if they answer nothing."""

    is_live = True

    def __init__(self, network: SessionConfig) -> None:
        """Join a graph, such as that of a router."""
        self.network, self.pace = network, Pace(1.0, slack_s=_SLACK_S)
        self.graph: Graph | None = None
        self._heard: dict[str, _HeardClock] = {}

    @property
    def start_ns(self) -> int:
        """Our own time of day [ns since 1970]."""
        return time.time_ns()

    def reading(self, robot: str) -> ClockReading:
        """As of the latest answer; the bound is half of the shortest round trip, about."""
        heard = self._heard.get(robot)
        return ClockReading() if heard is None else heard.reading()

    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        """Wait a moment for the first answers, so that the first stamps are those of the robot's clock."""
        bus, stacks = run.run.bus, run.run.parts.stacks
        self._clock, self._run = clock, run
        self.graph = Graph.watch(bus)
        self._heard = {
            name: _HeardClock(
                ClockExchanges(
                    bus,
                    self.graph,
                    f"{stack.context.namespace}/odom",
                    namespace=stack.context.hardware_namespace,
                )
            )
            for name, stack in stacks.items()
        }
        self._of_topic = {heard.topic: heard for heard in self._heard.values()}
        spaces = {name: stack.context.namespace for name, stack in stacks.items()}
        self._clocks = RobotClocks(clock, spaces) if len(stacks) > 1 else None
        bus.incoming = self._on_message
        end_s = time.monotonic() + _MEETING_S
        while time.monotonic() < end_s and any(
            each.answers < _FIRST_ANSWERS for each in self._heard.values()
        ):
            time.sleep(_LOOK_S)
            bus.admit()
            for each in self._heard.values():
                each.update()
        assert self.pace is not None
        self.pace.start()
        self._began_ns, self._began_at_ns = time.time_ns(), time.perf_counter_ns()
        self._follow(self._began_at_ns)  # what clocks show at the beginning is no event

    def after_tick(self) -> Sequence[ClockChange]:
        """Ask for the time, and follow the answers."""
        fresh = [each.update() for each in self._heard.values()]
        if not any(fresh):
            return ()
        # What is due now may come later: a machine that stutters is no reason to set clocks.
        due_ns = self._run.due_ns
        assert due_ns is not None
        return self._follow(due_ns)

    def close(self) -> None:
        """Watch the graph no more."""
        if self.graph is not None:
            self.graph.close()

    def _follow(self, now_ns: int) -> list[ClockChange]:
        """Follow the only robot's clock; among several our own, beside which each of theirs is followed."""
        if self._clocks is None:
            (heard,) = self._heard.values()
            return self._follow_one(heard, now_ns)
        own_ns = self._began_ns + now_ns - self._began_at_ns
        set_by_ns = self._clock.follow(own_ns, 0)
        changes = [ClockChange(what="pace", set_by_ns=set_by_ns)] if set_by_ns else []
        elapsed_ns = self._run.run.world.time_ns
        for name, heard in self._heard.items():
            shown_ns = heard.shown_ns(now_ns)
            if shown_ns is not None:
                changes += self._clocks.follow(name, elapsed_ns, shown_ns, heard.bound_ns)
        return changes

    def _follow_one(self, heard: _HeardClock, now_ns: int) -> list[ClockChange]:
        shown_ns = heard.shown_ns(now_ns)
        if shown_ns is None:
            return []
        set_by_ns = self._clock.follow(shown_ns, heard.bound_ns)
        steps, is_known = heard.steps, heard.is_known
        was_set = heard.followed != steps
        heard.followed, heard.is_known = steps, True
        if not set_by_ns:
            return []
        if not is_known:
            return [ClockChange(what="met", set_by_ns=set_by_ns)]
        return [ClockChange(what="clock" if was_set or set_by_ns < 0 else "pace", set_by_ns=set_by_ns)]

    def _on_message(self, topic: str, message: Any) -> None:
        heard = self._of_topic.get(topic)
        if heard is not None:
            heard.said(ns(message.header.stamp))
        if self._clocks is not None:
            self._clocks.stamp_anew(topic, message)


class _HeardClock:
    """One robot's clock, from its answers; from the stamps of its odometry where nobody answers."""

    def __init__(self, exchanges: ClockExchanges) -> None:
        self.answers = 0
        self.topic = exchanges.topic
        self._exchanges, self._said = exchanges, LeastDelay()
        self._waits_ns = time.perf_counter_ns()
        self.is_known = False
        """Whether it has been followed,"""
        self.followed = 0
        """and how many of its steps were."""
        self._has_said = False

    def update(self) -> bool:
        """Ask if it is time to; return whether something new is known."""
        fresh = self._exchanges.update()
        self.answers += fresh
        said, self._has_said = self._has_said, False
        return fresh or (said and not self._answers)

    def said(self, stamp_ns: int) -> None:
        """Take the stamp of a message that has just come."""
        now_ns = time.perf_counter_ns()
        self._said.take(stamp_ns, now_ns)
        self._has_said = True

    @property
    def _answers(self) -> bool:
        """Whether it answers, or may be about to."""
        return self._exchanges.estimate is not None or time.perf_counter_ns() - self._waits_ns < _PATIENCE_NS

    @property
    def bound_ns(self) -> int:
        """It may be off by so much."""
        estimate = self._exchanges.estimate
        return 0 if estimate is None else round(estimate.bound_s * 1e9)

    def shown_ns(self, now_ns: int) -> int | None:
        """Return what it shows at a `time.perf_counter_ns`; None: not known."""
        shown_ns = self._exchanges.other_ns(now_ns)
        if shown_ns is not None or self._answers or self._said.ahead_ns is None:
            return shown_ns
        return now_ns + self._said.ahead_ns

    @property
    def steps(self) -> int:
        """How often it was set."""
        asked = self._exchanges.estimate is not None
        return self._exchanges.offset.steps if asked else self._said.steps

    def reading(self) -> ClockReading:
        """Return what is known now."""
        now_ns, estimate = time.perf_counter_ns(), self._exchanges.estimate
        shown_ns = self.shown_ns(now_ns)
        if shown_ns is None:
            return ClockReading()
        offset_s = (shown_ns - time.time_ns()) * 1e-9
        if estimate is None:
            text = "the robot answers no question: its clock is known by its fastest messages alone"
            return ClockReading(offset_s=offset_s, text=text)
        return ClockReading(offset_s=offset_s, bound_s=estimate.bound_s)
