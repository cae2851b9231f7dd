"""The mission to explore: over when `/explore` is done."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.nodes.missions.mission_node import PERIOD_NS, MissionNode
from twin.nodes.navigation.exploration.explorer import ExplorerNode


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
