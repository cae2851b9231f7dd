"""A scenario's robots beside the physical ones: one process, one graph, the robots' clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self

from twin.bridge.graph import Graph
from twin.bridge.msgs import DiagnosticArray, DiagnosticStatus, KeyValue, String, header
from twin.bridge.qos import LATCHED
from twin.live.mirror.exchanges import ClockExchanges
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.label import LABELS, Evidence, Judgement, judge
from twin.live.mirror.robot import MirroredRobot
from twin.runtime.open_run import OpenRun
from twin.runtime.pacing import Pace
from twin.runtime.stacks.context import Layout
from twin.scenario.schema import Scenario

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig

NAMESPACE = "/twin"
"""Before the namespaces of virtual robots."""
_FOR_EVER_S = 1e9
_STATUS_NS = 100_000_000
_SLACK_S = 1.0
"""It makes up for what it is behind: the physical robots do not wait."""
_MEETING_S = 2.0
_FIRST_ANSWERS = 5
_LOOK_S = 0.02
_LEVELS = {"twin": 0, "shadow": 1, "model": 2}


@dataclass(frozen=True, kw_only=True)
class Status:
    """Of one robot, now."""

    robot: str
    judgement: Judgement
    evidence: Evidence


class Mirror:
    """Keeps a scenario's robots with physical ones that are on the graph under the same names."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        network: SessionConfig,
        autonomy: Literal["all", "localisation", "none"] = "none",
        out: Path | None = None,
    ) -> None:
        """Build the virtual robots, and join the graph.

        Args:
            scenario: Its robots and world; its localisation, navigation and missions, as `autonomy` says.
            network: Where the physical robots are.
            autonomy: What of the physical robots' autonomy runs here.
            out: Folder for a recording; None: there is none.

        Raises:
            TwinError: A robot cannot be made, or nobody can be reached.
        """
        changes: dict[str, object] = {"faults": (), "early_stop": "never", "duration": _FOR_EVER_S}
        self.clock = FollowedClock(time.time_ns())
        pace = Pace(1.0, slack_s=_SLACK_S)
        with ExitStack() as ending:
            self.run = OpenRun(
                scenario.model_copy(update=changes),
                out=out,
                record=out is not None,
                network=network,
                pace=pace,
                clock=self.clock,
                layout=Layout(autonomy=autonomy, hardware=NAMESPACE),
            )
            ending.callback(self.run.close)
            run = self.run.run
            graph = Graph.watch(run.bus)
            ending.callback(graph.close)
            stacks = run.parts.stacks.values()
            self.robots = tuple(
                MirroredRobot(stack, run.world, held=run.observer.holders) for stack in stacks
            )
            first = self.robots[0].stack.context
            self.exchanges = ClockExchanges(
                run.bus, graph, f"{first.namespace}/odom", namespace=first.hardware_namespace
            )
            node = run.bus.create_node("status", NAMESPACE)
            self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
            self._label = node.create_publisher(String, "label", LATCHED)
            self._told_ns = self._steps = 0
            self._labels: dict[str, str] = {}
            self._meet()
            pace.start()
            self._ending = ending.pop_all()

    def advance(self, until: Callable[[], bool] = lambda: False) -> None:
        """Go on until a condition holds after a tick; raises TwinError if it cannot go on."""
        self.run.advance(lambda: self._after_tick() or until())

    def statuses(self) -> list[Status]:
        """Return how each robot is mirrored now."""
        found = []
        estimate = self.exchanges.estimate
        for robot in self.robots:
            difference = robot.difference
            heard_ns = robot.heard_ns
            evidence = Evidence(
                age_s=None if heard_ns is None else max(0.0, (self.clock.now_ns - heard_ns) * 1e-9),
                position=None if difference is None else difference.position,
                yaw=None if difference is None else difference.yaw,
                clock_bound_s=None if estimate is None else estimate.bound_s,
            )
            found.append(Status(robot=robot.stack.name, judgement=judge(evidence), evidence=evidence))
        return found

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the graph. Harmless when repeated."""
        self._ending.close()

    def _after_tick(self) -> bool:
        if self.exchanges.update():
            self._set_clock()
        now_ns = time.monotonic_ns()
        if now_ns - self._told_ns >= _STATUS_NS:
            self._told_ns = now_ns
            self._tell(self.statuses())
        return False

    def _set_clock(self) -> None:
        # What is due now may come later: a machine that stutters is no reason to set clocks.
        due_ns, estimate = self.run.due_ns, self.exchanges.estimate
        other_ns = self.exchanges.other_ns(time.perf_counter_ns() if due_ns is None else due_ns)
        assert other_ns is not None
        assert estimate is not None
        set_by = self.clock.follow(other_ns, round(estimate.bound_s * 1e9)) * 1e-9
        steps, self._steps = self._steps, self.exchanges.offset.steps
        if not set_by or not self.run.run.world.time_ns:
            return
        for robot in self.robots:
            if self._steps > steps or set_by < 0.0:
                robot.forget()
                robot.tell("clock", f"the robot's clock was set by {set_by:+.3f} s")
            else:
                robot.tell("pace", f"this computer was too slow: {set_by:.3f} s are lost")

    def _meet(self) -> None:
        """Wait for the first answers, so that the first stamps are those of the robot's clock."""
        end_s, answers = time.monotonic() + _MEETING_S, 0
        while answers < _FIRST_ANSWERS and time.monotonic() < end_s:
            time.sleep(_LOOK_S)
            self.run.run.bus.admit()
            answers += self.exchanges.update()
        if answers:
            self._set_clock()

    def _tell(self, statuses: list[Status]) -> None:
        array = DiagnosticArray(header=header(self.clock.now_ns, ""), status=[])
        for status in statuses:
            label = status.judgement.label
            values = {
                "age_s": status.evidence.age_s,
                "position_m": status.evidence.position,
                "yaw_rad": status.evidence.yaw,
                "clock_bound_s": status.evidence.clock_bound_s,
            }
            array.status.append(
                DiagnosticStatus(
                    level=_LEVELS[label],
                    name=f"twin: {status.robot}",
                    message=f"{label}: {'; '.join(status.judgement.why)}".removesuffix(": "),
                    hardware_id=status.robot,
                    values=[
                        KeyValue(key=key, value="" if value is None else f"{value:.6g}")
                        for key, value in values.items()
                    ],
                )
            )
        self._diagnostics.publish(array)
        worst = min((status.judgement.label for status in statuses), key=LABELS.index)
        if self._labels.get("") != worst:
            self._labels[""] = worst
            self._label.publish(String(data=worst))
