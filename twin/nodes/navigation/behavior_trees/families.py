"""Leaves that are alike but for a name: they cancel an action, or let a topic choose a plugin.

Source: Nav2's BtCancelActionNode, plugins/action/*_selector_node.
"""

from __future__ import annotations

from typing import ClassVar

from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED
from twin.bridge.services import Future
from twin.bridge.types import ActionType
from twin.navigation.behavior_trees.node import NodeSetup, Status
from twin.navigation.behavior_trees.ports import Port, inputs, outputs
from twin.nodes.navigation.behavior_trees import actions
from twin.nodes.navigation.behavior_trees.action_node import ACTION_PORTS, ActionNode, NavigatorNode


class CancelNode(NavigatorNode):
    """Cancels every goal of an action, whoever sent it; succeeds when the server has answered."""

    ACTION: ClassVar[ActionType]
    SERVER: ClassVar[str]
    PORTS: ClassVar[tuple[Port, ...]] = ACTION_PORTS
    _asked: Future | None = None

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._client = self.context.action_client(self.ACTION, self.get("server_name") or self.SERVER)

    def tick(self) -> Status:
        """Ask, and wait for the answer."""
        self.set_status(Status.RUNNING)
        if self._asked is None:
            self._asked = self._client.cancel_all()
        if not self._asked.done:
            return Status.RUNNING
        error, self._asked = self._asked.error, None
        return Status.SUCCESS if error is None else Status.FAILURE

    def halt(self) -> None:
        """Wait no more."""
        self._asked = None


def _cancel(name: str, of: type[ActionNode]) -> type[CancelNode]:
    doc = f"Cancels `{of.SERVER}`."
    return type(name, (CancelNode,), {"ACTION": of.ACTION, "SERVER": of.SERVER, "__doc__": doc})


CANCEL_NODES = {
    name: _cancel(name, of)
    for name, of in (
        ("CancelControl", actions.FollowPath),
        ("CancelBackUp", actions.BackUp),
        ("CancelSpin", actions.Spin),
        ("CancelWait", actions.Wait),
        ("CancelDriveOnHeading", actions.DriveOnHeading),
        ("CancelAssistedTeleop", actions.AssistedTeleop),
        ("CancelDock", actions.DockRobot),
        ("CancelUndock", actions.UndockRobot),
    )
}
"""By their names in the XML."""


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
