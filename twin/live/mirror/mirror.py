"""A scenario's robots beside the physical ones: one process, one graph, the robots' clock."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from twin.bridge.msgs import DiagnosticArray, DiagnosticStatus, KeyValue, String, header
from twin.bridge.qos import LATCHED
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.label import LABELS, Evidence, Judgement, judge
from twin.live.mirror.robot import MirroredRobot
from twin.live.mirror.source import Source
from twin.runtime.open_run import OpenRun
from twin.runtime.stacks.context import Layout
from twin.scenario.schema import Scenario

NAMESPACE = "/twin"
"""Before the namespaces of virtual robots."""
_FOR_EVER_S = 1e9
_STATUS_NS = 100_000_000
_LEVELS = {"twin": 0, "shadow": 1, "model": 2}


@dataclass(frozen=True, kw_only=True)
class Status:
    """Of one robot, now."""

    robot: str
    judgement: Judgement
    evidence: Evidence


class Mirror:
    """Keeps a scenario's robots with physical ones that have the same names."""

    def __init__(
        self,
        scenario: Scenario,
        source: Source,
        *,
        autonomy: Literal["all", "localisation", "none"] = "none",
        out: Path | None = None,
        bag: Path | None = None,
    ) -> None:
        """Build the virtual robots beside the physical ones of `source`; close the mirror, and it is closed.

        Args:
            scenario: Its robots and world; its localisation, navigation and missions, as `autonomy` says.
            source: Where the physical robots are.
            autonomy: What of the physical robots' autonomy runs here.
            out: Folder for a recording; None: there is none.
            bag: Folder for a bag of everything that was heard and said; it can be a source again.

        Raises:
            TwinError: A robot cannot be made, or nobody can be reached.
        """
        changes: dict[str, object] = {"faults": (), "early_stop": "never", "duration": _FOR_EVER_S}
        self.source, self.clock = source, FollowedClock(source.start_ns)
        with ExitStack() as ending:
            ending.callback(source.close)
            self.run = OpenRun(
                scenario.model_copy(update=changes),
                out=out,
                record=out is not None,
                network=source.network,
                pace=source.pace,
                bag=bag,
                clock=self.clock,
                layout=Layout(autonomy=autonomy, hardware=NAMESPACE),
            )
            ending.callback(self.run.close)
            run = self.run.run
            stacks = run.parts.stacks.values()
            self.robots = tuple(
                MirroredRobot(stack, run.world, held=run.observer.holders) for stack in stacks
            )
            node = run.bus.create_node("status", NAMESPACE)
            self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
            self._label = node.create_publisher(String, "label", LATCHED)
            self._told_ns = 0
            self._labels: dict[str, str] = {}
            source.begin(self.run, self.clock)
            self._ending = ending.pop_all()

    def advance(self, until: Callable[[], bool] = lambda: False) -> None:
        """Go on until a condition holds after a tick; raises TwinError if it cannot go on."""
        self.run.advance(lambda: self._after_tick() or until())

    def statuses(self) -> list[Status]:
        """Return how each robot is mirrored now."""
        found = []
        for robot in self.robots:
            difference = robot.difference
            heard_ns = robot.heard_ns
            evidence = Evidence(
                age_s=None if heard_ns is None else max(0.0, (self.clock.now_ns - heard_ns) * 1e-9),
                position=None if difference is None else difference.position,
                yaw=None if difference is None else difference.yaw,
                clock_bound_s=self.source.clock_bound_s,
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
        event = self.source.after_tick()
        if event is not None:
            for robot in self.robots:
                if event[0] == "clock":
                    robot.forget()
                robot.tell(*event)
        now_ns = self.run.run.world.time_ns
        if now_ns - self._told_ns >= _STATUS_NS:
            self._told_ns = now_ns
            self._tell(self.statuses())
        return self.source.over

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
