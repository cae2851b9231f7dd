"""A scenario's robots beside the physical ones: one process, one graph, the robots' clock."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Literal, Self

from twin.bridge.msgs import DiagnosticArray, String
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.label import Label
from twin.live.mirror.robot import COMMANDED, MirroredRobot
from twin.live.mirror.shown import Shown
from twin.live.mirror.source import Source
from twin.live.mirror.status import Status, to_array, worst
from twin.live.mirror.status_text import status_text
from twin.live.mirror.taking_over import take_over
from twin.live.mirror.verdict import mirror_verdict
from twin.runtime.open_run import OpenRun
from twin.runtime.stacks.context import Layout
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Verdict

NAMESPACE = "/twin"
"""Before the namespaces of virtual robots."""
_FOR_EVER_S = 1e9
_STATUS_NS = 100_000_000


class Mirror:
    """Keeps a scenario's robots with physical ones that have the same names."""

    def __init__(
        self,
        scenario: Scenario,
        source: Source,
        *,
        autonomy: Literal["all", "localisation", "none"] = "none",
        guard: str | None = None,
        out: Path | None = None,
        bag: Path | None = None,
    ) -> None:
        """Build the virtual robots beside the physical ones of `source`; close the mirror, and it is closed.

        Args:
            scenario: Its robots and world; its localisation, navigation and missions, as `autonomy` says.
            source: Where the physical robots are.
            autonomy: What of the physical robots' autonomy runs here.
            guard: Name of the guards' nodes, behind the robots' namespaces, through which autonomy here
                commands them; None: it does by `cmd_vel`.
            out: Folder for a recording; None: there is none.
            bag: Folder for a bag of everything that was heard and said; it can be a source again.

        Raises:
            TwinError: A robot cannot be made, or nobody can be reached.
        """
        # When something comes or walks is not known of a world that is.
        still = [box for box in scenario.world.obstacles if box.route is None and box.appears_within is None]
        changes: dict[str, object] = {
            "world": scenario.world.model_copy(update={"obstacles": tuple(still)}),
            "faults": (),
            "checks": (),
            "early_stop": "never",
            "duration": _FOR_EVER_S,
        }
        self.source, self.clock = source, FollowedClock(source.start_ns)
        self._shown = shown = Shown(NAMESPACE)
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
                shown=shown.tap,
                endless=True,
                layout=Layout(
                    autonomy=autonomy, hardware=NAMESPACE, commands="" if guard is None else COMMANDED
                ),
            )
            ending.callback(self.run.close)
            run = self.run.run
            self._drivers = self._in_namespace()
            self.run.when_alone.append(self._take_over)
            shown.begin(run.world)
            run.bus.arrival_taps.append(shown.on_arrival)
            stacks = run.parts.stacks.values()
            self.robots = tuple(
                MirroredRobot(stack, run.world, held=run.observer.holders, guard=guard) for stack in stacks
            )
            node = run.bus.create_node("status", NAMESPACE)
            self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
            self._label = node.create_publisher(String, "label", LATCHED)
            self._told_ns = 0
            self._told: Label | None = None
            self._seconds: dict[Label, float] = {}
            self._scenario = scenario
            source.begin(self.run, self.clock)
            self._ending = ending.pop_all()

    def advance(self, until: Callable[[], bool] = lambda: False) -> None:
        """Go on until a condition holds after a tick; raises TwinError if it cannot go on."""
        self.run.advance(lambda: self._after_tick() or until())

    def statuses(self) -> list[Status]:
        """Return how each robot is mirrored now."""
        return [robot.status(self.clock.now_ns, self.source) for robot in self.robots]

    def verdict(self) -> Verdict:
        """Judge what was so far: see `mirror_verdict`."""
        return mirror_verdict(
            self._scenario,
            {robot.stack.name: robot.divergence.monitor.report() for robot in self.robots},
            {robot.stack.name: robot.follower.resets for robot in self.robots},
            worst(self.statuses()),
            self._seconds,
            is_live=self.source.is_live,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the graph. Harmless when repeated."""
        self._ending.close()

    def _in_namespace(self) -> tuple[Node, ...]:
        """Return the nodes in the namespace of virtual robots."""
        nodes = self.run.run.bus.nodes
        return tuple(node for node in nodes if f"{node.namespace}/".startswith(f"{NAMESPACE}/"))

    def _take_over(self) -> None:
        """Be, in a fork, a run of virtual robots: with their own sensors, from where they are."""
        own = [node for node in self._in_namespace() if node not in self._drivers]
        take_over(self.run.run.bus, self.robots, own, self._drivers, NAMESPACE)

    def _after_tick(self) -> bool:
        for change in self.source.after_tick():
            for robot in self.robots:
                if change.robot in (None, robot.stack.name):
                    robot.clock_changed(change)
        now_ns = self.run.run.world.time_ns
        if now_ns - self._told_ns >= _STATUS_NS:
            self._told_ns = now_ns
            self._tell(self.statuses())
        return self.source.over

    def _tell(self, statuses: list[Status]) -> None:
        self._diagnostics.publish(to_array(statuses, self.clock.now_ns))
        self._shown.tell(status_text(statuses))
        label = worst(statuses)
        self._seconds[label] = self._seconds.get(label, 0.0) + _STATUS_NS * 1e-9
        if label != self._told:
            self._told = self.run.label = label
            self._label.publish(String(data=label))
