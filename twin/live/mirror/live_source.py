"""Physical robots on a ROS graph, now."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from twin.bridge.graph import Graph
from twin.live.mirror.exchanges import ClockExchanges
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


class LiveSource(Source):
    """The graph; a robot's clock is known from what its nodes answer."""

    is_live = True

    def __init__(self, network: SessionConfig) -> None:
        """Join a graph, such as that of a router."""
        self.network, self.pace = network, Pace(1.0, slack_s=_SLACK_S)
        self.exchanges: ClockExchanges | None = None
        self.graph: Graph | None = None
        self._steps = 0

    @property
    def start_ns(self) -> int:
        """Our own time of day [ns since 1970]."""
        return time.time_ns()

    def reading(self, robot: str) -> ClockReading:
        """As of the latest answer; the bound is half of the shortest round trip, about."""
        estimate = None if self.exchanges is None else self.exchanges.estimate
        now_ns = time.perf_counter_ns()
        other_ns = None if self.exchanges is None else self.exchanges.other_ns(now_ns)
        if estimate is None or other_ns is None:
            return ClockReading()
        return ClockReading(offset_s=(other_ns - time.time_ns()) * 1e-9, bound_s=estimate.bound_s)

    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        """Wait a moment for the first answers, so that the first stamps are those of the robot's clock."""
        bus = run.run.bus
        context = next(iter(run.run.parts.stacks.values())).context
        self._clock, self._run = clock, run
        self.graph = Graph.watch(bus)
        self.exchanges = ClockExchanges(
            bus, self.graph, f"{context.namespace}/odom", namespace=context.hardware_namespace
        )
        end_s, answers = time.monotonic() + _MEETING_S, 0
        while answers < _FIRST_ANSWERS and time.monotonic() < end_s:
            time.sleep(_LOOK_S)
            bus.admit()
            answers += self.exchanges.update()
        if answers:
            self._follow(time.perf_counter_ns())
        assert self.pace is not None
        self.pace.start()

    def after_tick(self) -> Sequence[ClockChange]:
        """Ask for the time, and follow the answers."""
        assert self.exchanges is not None
        if not self.exchanges.update():
            return ()
        # What is due now may come later: a machine that stutters is no reason to set clocks.
        due_ns = self._run.due_ns
        assert due_ns is not None
        set_by_ns = self._follow(due_ns)
        steps, self._steps = self._steps, self.exchanges.offset.steps
        if not set_by_ns:
            return ()
        is_set = self._steps > steps or set_by_ns < 0
        return (ClockChange(what="clock" if is_set else "pace", set_by_ns=set_by_ns),)

    def close(self) -> None:
        """Watch the graph no more."""
        if self.graph is not None:
            self.graph.close()

    def _follow(self, now_ns: int) -> int:
        assert self.exchanges is not None
        other_ns, estimate = self.exchanges.other_ns(now_ns), self.exchanges.estimate
        assert other_ns is not None
        assert estimate is not None
        return self._clock.follow(other_ns, round(estimate.bound_s * 1e9))
