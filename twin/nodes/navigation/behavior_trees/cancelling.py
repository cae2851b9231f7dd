"""Leaves that cancel an action (Nav2's BtCancelActionNode)."""

from __future__ import annotations

from typing import ClassVar

from twin.bridge import action_types
from twin.bridge.services import Future
from twin.bridge.types import ActionType
from twin.navigation.behavior_trees.node import NodeSetup, Status
from twin.navigation.behavior_trees.ports import Port
from twin.nodes.navigation.behavior_trees.action_node import ACTION_PORTS, NavigatorNode


class CancelNode(NavigatorNode):
    """Cancels every goal of an action, whoever sent it; succeeds when the server has answered."""

    ACTION: ClassVar[ActionType]
    SERVER: ClassVar[str]
    PORTS: ClassVar[tuple[Port, ...]] = ACTION_PORTS

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._client = self.context.action_client(self.ACTION, self.get("server_name") or self.SERVER)
        self._asked: Future | None = None

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


def _cancel(name: str, action: ActionType, server: str) -> type[CancelNode]:
    doc = f"Cancels `{server}`."
    return type(name, (CancelNode,), {"ACTION": action, "SERVER": server, "__doc__": doc})


CANCEL_NODES = {
    name: _cancel(name, action, server)
    for name, action, server in (
        ("CancelControl", action_types.FollowPath, "follow_path"),
        ("CancelBackUp", action_types.BackUp, "backup"),
        ("CancelSpin", action_types.Spin, "spin"),
        ("CancelWait", action_types.Wait, "wait"),
        ("CancelDriveOnHeading", action_types.DriveOnHeading, "drive_on_heading"),
        ("CancelAssistedTeleop", action_types.AssistedTeleop, "assisted_teleop"),
        ("CancelDock", action_types.DockRobot, "dock_robot"),
        ("CancelUndock", action_types.UndockRobot, "undock_robot"),
    )
}
"""By their names in the XML."""
