"""A leaf that is an action of a server (Nav2's BtActionNode)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from twin.bridge.actions import ClientGoal
from twin.bridge.msgs import GoalStatus
from twin.bridge.types import ActionType
from twin.navigation.behavior_trees.node import NodeSetup, Status, TreeNode
from twin.navigation.behavior_trees.ports import inputs, outputs
from twin.nodes.navigation.behavior_trees.context import NavigatorContext, fill, seconds

ACTION_PORTS = inputs(server_name="string", server_timeout="unsigned")
ERROR_PORTS = outputs(error_code_id="unsigned", error_msg="string")

GOAL_REJECTED, SEND_GOAL_FAILURE = 1, 2
"""Codes of every Nav2 action since Kilted."""


class NavigatorNode(TreeNode):
    """A node that needs what the navigator has."""

    context: NavigatorContext
    FIELDS: ClassVar[Mapping[str, str]] = {}
    """Port -> field of the message that is sent or comes back, where their names differ."""

    def filled(self, cls: type, **values: Any) -> Any:
        """Return a message with these values, and those of the ports for which it has fields."""
        given: dict[str, Any] = {}
        for port in self.PORTS:
            value = None if port.is_output else self.get(port.name)
            if value is not None:
                name = self.FIELDS.get(port.name, port.name)
                given[name] = seconds(value) if port.type == "seconds" else value
        return fill(cls, **{**given, **values})

    def is_late(self, since_ns: int) -> bool:
        """Whether a server, asked at a time [ns], should have answered by now."""
        timeout = self.get("server_timeout")
        timeout_ns = self.context.server_timeout_ns if timeout is None else timeout * 1_000_000
        return bool(self.context.now_ns() - since_ns > timeout_ns)

    def count_recovery(self) -> None:
        """Count one more recovery, as Nav2 counts them for its feedback."""
        board = self.blackboard.root
        board.set("number_recoveries", board.get("number_recoveries", 0) + 1)


class ActionNode(NavigatorNode):
    """Sends a goal and waits for its result; cancels it when halted."""

    ACTION: ClassVar[ActionType]
    SERVER: ClassVar[str]
    """Name of the action, unless `server_name` gives another."""

    _sent: ClientGoal | None = None
    _sent_ns = 0

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._client = self.context.action_client(self.ACTION, self.get("server_name") or self.SERVER)

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal, of the ports and of values; None if there is nothing to do, and the node fails."""
        return self.filled(self.ACTION.Goal, **values)

    def updated_goal(self) -> Any | None:
        """Return a goal to go on with instead, while the last one is being executed."""
        return None

    def on_success(self, result: Any) -> Status:
        """Write the outputs that the result has fields for."""
        for port in self.PORTS:
            field = self.FIELDS.get(port.name, port.name)
            if port.is_output and hasattr(result, field):
                self.put(port.name, getattr(result, field))
        self._put_error(0, "")
        return Status.SUCCESS

    def on_aborted(self, result: Any) -> Status:
        """Write the error."""
        self._put_error(int(getattr(result, "error_code", 0)), str(getattr(result, "error_msg", "")))
        return Status.FAILURE

    def on_cancelled(self) -> Status:
        """Forget errors: somebody wanted the end."""
        self._put_error(0, "")
        return Status.SUCCESS

    def tick(self) -> Status:
        """Send the goal, or look how it is doing."""
        if not self.status.is_active:
            goal = self.make_goal()
            self.set_status(Status.RUNNING)
            if goal is None:
                return Status.FAILURE
            self._send(goal)
        elif self.status.is_completed:
            return self.status  # sequences tick what has ended, too
        sent = self._sent
        if sent is None:
            return Status.FAILURE
        if sent.accepted is None:
            if self.is_late(self._sent_ns):
                return self._fail(SEND_GOAL_FAILURE, f"{self._client.name} does not answer")
            return Status.RUNNING
        if not sent.done:
            following = self.updated_goal()
            if following is not None:
                self._send(following)
            return Status.RUNNING
        if not sent.accepted or sent.error is not None:
            return self._fail(GOAL_REJECTED, sent.error or f"{self._client.name} rejected the goal")
        self._sent = None
        if sent.status == GoalStatus.STATUS_SUCCEEDED:
            return self.on_success(sent.result)
        if sent.status == GoalStatus.STATUS_CANCELED:
            return self.on_cancelled()
        return self.on_aborted(sent.result)

    def halt(self) -> None:
        """Cancel the goal."""
        if self._sent is not None and not self._sent.done:
            self._sent.cancel()
            self.on_cancelled()
        self._sent = None

    def _send(self, goal: Any) -> None:
        self._sent = self._client.send_goal(goal)
        self._sent_ns = self.context.now_ns()

    def _fail(self, code: int, reason: str) -> Status:
        self._sent = None
        self._put_error(code, reason)
        return Status.FAILURE

    def _put_error(self, code: int, message: str) -> None:
        self.put("error_code_id", code)
        self.put("error_msg", message)
