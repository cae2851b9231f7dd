"""Nav2's leaves that let a topic choose a plugin (plugins/action/*_selector_node)."""

from __future__ import annotations

from typing import ClassVar

from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED
from twin.navigation.behavior_trees.node import NodeSetup, Status
from twin.navigation.behavior_trees.ports import Port, inputs, outputs
from twin.nodes.navigation.behavior_trees.action_node import NavigatorNode


class SelectorNode(NavigatorNode):
    """Writes the name that came last on a topic, or its default; fails without both."""

    WHAT: ClassVar[str]
    """controller, planner and so on: part of the ports' names."""

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._latest = self.context.latest(String, self.get("topic_name"), LATCHED)

    def tick(self) -> Status:
        """Choose."""
        message = self._latest.message
        chosen = message.data if message is not None else self.get(f"default_{self.WHAT}")
        if not chosen:
            return Status.FAILURE
        self.put(f"selected_{self.WHAT}", chosen)
        return Status.SUCCESS


def _selector(what: str) -> type[SelectorNode]:
    ports: tuple[Port, ...] = (
        *inputs(**{f"default_{what}": "string"}),
        *inputs(topic_name=("string", f"{what}_selector")),
        *outputs(**{f"selected_{what}": "string"}),
    )
    name = "".join(word.title() for word in what.split("_")) + "Selector"
    return type(name, (SelectorNode,), {"WHAT": what, "PORTS": ports, "__doc__": f"Selects the {what}."})


SELECTORS = {
    cls.__name__: cls
    for cls in map(
        _selector,
        ("planner", "controller", "smoother", "goal_checker", "progress_checker", "path_handler"),
    )
}
