"""Simple missions: actions one after the other, a profile of velocities, exploring to the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from twin.bridge.actions import ActionClient
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.bridge.types import ActionType
from twin.navigation.behavior_trees.node import TreeNode
from twin.nodes.missions.leaves import CallAction, Do, WaitUntil, sequence
from twin.nodes.missions.mission_node import PERIOD_NS, MissionNode
from twin.periods import next_due

if TYPE_CHECKING:
    from twin.nodes.navigation.exploration.explorer import ExplorerNode

_SETTLE_NS = 1_000_000_000
"""After the last velocity, until the robot stands [ns]."""


@dataclass(frozen=True)
class ActionStep:
    """One action to call."""

    label: str
    """Shown as the mission's state."""
    action_type: ActionType
    name: str
    """Of the action."""
    goal: Callable[[], Any]
    """Makes the goal message when its turn comes."""
    ready: Callable[[], bool] | None = None
    """What the step waits for."""


class ActionSequenceNode(MissionNode):
    """Calls actions one after the other; the first that fails ends the mission."""

    def __init__(self, bus: Bus, steps: Sequence[ActionStep], *, namespace: str = "") -> None:
        super().__init__(bus, namespace=namespace)
        clients: dict[str, ActionClient] = {}
        leaves: list[TreeNode] = []
        for step in steps:
            if step.name not in clients:
                clients[step.name] = ActionClient(self.node, step.action_type, step.name)
            leaves.append(Do(f"State[{step.label}]", partial(self.enter, step.label)))
            if step.ready is not None:
                leaves.append(WaitUntil(f"Ready[{step.label}]", step.ready))
            leaves.append(CallAction(step.name, clients[step.name], step.goal, on_failure=self.note))
        self.run(sequence("Behaviors", leaves), PERIOD_NS)


class VelocityProfileNode(MissionNode):
    """Sends velocities open loop on `cmd_vel`: steps of duration [s], linear [m/s], angular [rad/s].

    A step ends in the first control period at or after its end; ends are counted from the start.
    """

    def __init__(
        self,
        bus: Bus,
        steps: Sequence[tuple[float, float, float]],
        *,
        control_period_ns: int = 20_000_000,
        namespace: str = "",
    ) -> None:
        super().__init__(bus, namespace=namespace)
        self._ends: list[tuple[int, float, float]] = []
        end = 0
        for duration, linear, angular in steps:
            end += round(duration * 1e9)
            self._ends.append((end, linear, angular))
        self._start = self._due_ns = next_due(PERIOD_NS, self.node.steady_ns)
        self._step = -1
        self._commands = self.node.create_publisher(Twist, "cmd_vel", 10)
        self.node.create_timer(control_period_ns, self._update)

    def _update(self) -> None:
        now = self.node.steady_ns
        elapsed = now - self._start
        if self.done or elapsed < 0:
            return
        step = next((i for i, (end, _, _) in enumerate(self._ends) if elapsed < end), len(self._ends))
        begins = step != self._step
        if not begins and now < self._due_ns:
            return
        self._due_ns, self._step = next_due(PERIOD_NS, now), step
        if step == len(self._ends):
            self._commands.publish(twist_from_planar(0.0, 0.0), frozen=True)
            if elapsed >= self._ends[-1][0] + _SETTLE_NS:
                self.finish(succeeded=True)
            return
        _, linear, angular = self._ends[step]
        if begins:
            self.enter(f"step {step + 1} of {len(self._ends)}: {linear:+.2f} m/s, {angular:+.2f} rad/s")
        self._commands.publish(twist_from_planar(linear, angular), frozen=True)


class ExploreMissionNode(MissionNode):
    """Tells what `/explore` does as the mission's state, and ends with it."""

    def __init__(self, bus: Bus, explorer: ExplorerNode, *, namespace: str = "") -> None:
        super().__init__(bus, namespace=namespace)
        self._explorer = explorer
        self.node.create_timer(PERIOD_NS, self._update)

    def _update(self) -> None:
        if self.done:
            return
        explorer = self._explorer
        goal = explorer.explorer.goal
        state = explorer.status.replace("_", " ")
        if goal is not None:
            state += f": frontier at ({goal.target[0]:.1f}, {goal.target[1]:.1f})"
        if state != self.state:
            self.enter(state)
        if explorer.done:
            if not explorer.succeeded:
                self.note(explorer.reason or "no frontier could be reached")
            self.finish(bool(explorer.succeeded))
