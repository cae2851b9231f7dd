"""Action clients: a goal that is polled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import xxhash

from twin.bridge.defaults import new
from twin.bridge.msgs import UUID, GoalInfo, GoalStatus, Time
from twin.bridge.services import Future
from twin.bridge.srvs import CancelGoal
from twin.bridge.types import ActionType

if TYPE_CHECKING:
    from twin.bridge.node import Node


class ClientGoal:
    """A goal as its client sees it; changes in spins of the client's node."""

    def __init__(self, client: ActionClient, goal_id: bytes) -> None:
        self.goal_id = goal_id
        """16 bytes."""
        self.accepted: bool | None = None
        """None until the server has answered."""
        self.status: int = GoalStatus.STATUS_UNKNOWN
        """A constant of action_msgs/GoalStatus."""
        self.result: Any = None
        """The result message once done; None if the goal was rejected or the server is gone."""
        self.error: str | None = None
        """Why there is no result."""
        self.done = False
        """Whether nothing will change any more: a result, a rejection or an error."""
        self._client = client

    @property
    def succeeded(self) -> bool:
        """Whether the goal ended with success."""
        return self.status == GoalStatus.STATUS_SUCCEEDED

    def cancel(self) -> Future:
        """Ask the server to end the goal; the future's result is a CancelGoal response."""
        return self._client.cancel(self)


class ActionClient:
    """Sends goals to an action server."""

    def __init__(self, node: Node, action_type: ActionType, name: str) -> None:
        """Make a client of the action `name`.

        Raises:
            BridgeError: an invalid name.
        """
        self._type = action_type
        self.name = node.resolve_name(name)
        """Absolute name of the action."""
        self._goals: dict[bytes, Callable[[Any], None] | None] = {}
        self._count = 0
        # Not the gid: that depends on what other nodes have created before.
        self._seed = f"{node.bus.session_id}{node.fully_qualified_name}#{len(node.endpoints)}".encode()
        base = f"{self.name}/_action"
        self._send = node.create_client(action_type.SendGoal, f"{base}/send_goal")
        self._cancel = node.create_client(CancelGoal, f"{base}/cancel_goal")
        self._result = node.create_client(action_type.GetResult, f"{base}/get_result")
        node.create_subscription(action_type.FeedbackMessage, f"{base}/feedback", self._on_feedback)

    @property
    def server_is_ready(self) -> bool:
        """Whether somebody offers the action now."""
        return self._send.service_is_ready

    def send_goal(self, goal: Any, feedback_callback: Callable[[Any], None] | None = None) -> ClientGoal:
        """Send a goal; the callback gets each Feedback message.

        Raises:
            TypeError: a goal of another type.
        """
        if type(goal) is not self._type.Goal:
            raise TypeError(f"{self.name} takes {self._type.name}_Goal, not {type(goal).__name__}")
        self._count += 1
        # Unique like a random UUID, and the same in the same run.
        goal_id = xxhash.xxh3_128_digest(self._seed + self._count.to_bytes(8, "little"))
        client_goal = ClientGoal(self, goal_id)
        self._goals[goal_id] = feedback_callback
        request = self._type.SendGoal.Request(_uuid(goal_id), goal)
        self._send.call_async(request).add_done_callback(lambda f: self._on_accepted(client_goal, f))
        return client_goal

    def cancel(self, goal: ClientGoal) -> Future:
        """Ask the server to end a goal."""
        return self._cancel.call_async(CancelGoal.Request(GoalInfo(_uuid(goal.goal_id), new(Time))))

    def _on_accepted(self, goal: ClientGoal, future: Future) -> None:
        if future.error is not None:
            goal.accepted = False
            self._finish(goal, future.error)
            return
        goal.accepted = bool(future.result.accepted)
        if not goal.accepted:
            self._finish(goal, f"the action {self.name} rejected the goal")
            return
        goal.status = GoalStatus.STATUS_EXECUTING
        request = self._type.GetResult.Request(_uuid(goal.goal_id))
        self._result.call_async(request).add_done_callback(lambda f: self._on_result(goal, f))

    def _on_result(self, goal: ClientGoal, future: Future) -> None:
        if future.error is None:
            goal.status = int(future.result.status)
            goal.result = future.result.result
        else:
            goal.status = GoalStatus.STATUS_UNKNOWN
        self._finish(goal, future.error)

    def _finish(self, goal: ClientGoal, error: str | None) -> None:
        goal.error = error
        goal.done = True
        self._goals.pop(goal.goal_id, None)

    def _on_feedback(self, message: Any) -> None:
        callback = self._goals.get(bytes(message.goal_id.uuid))
        if callback is not None:
            callback(message.feedback)


def _uuid(goal_id: bytes) -> UUID:
    return UUID(np.frombuffer(goal_id, np.uint8))
