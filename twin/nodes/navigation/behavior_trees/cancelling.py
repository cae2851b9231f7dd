"""Leaves that cancel an action (Nav2's BtCancelActionNode)."""

from __future__ import annotations

from typing import ClassVar

from twin.bridge.services import Future
from twin.bridge.types import ActionType
from twin.navigation.behavior_trees.node import NodeSetup, Status
from twin.navigation.behavior_trees.ports import Port
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
