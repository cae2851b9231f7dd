"""Action clients: a goal that is polled."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any, NamedTuple

import xxhash

from twin.bridge.actions.goal import ACTIVE, uuid_msg
from twin.bridge.msgs import GoalInfo, GoalStatus, GoalStatusArray, new, stamp
from twin.bridge.qos import LATCHED, as_qos
from twin.bridge.services import Future
from twin.bridge.srvs import CancelGoal
from twin.bridge.topics import Subscription
from twin.bridge.types import ActionType

if TYPE_CHECKING:
    from twin.bridge.node import Node


_GOAL_ID = slice(4, 20)
"""Where it is in a feedback message: after CDR's encapsulation header."""


class ClientGoal:
    """A goal as its client sees it; changes in spins of the client's node.

    In executions and tasks `yield from goal` waits until it is done.
    """

    def __init__(self, client: ActionClient, goal_id: bytes) -> None:
        self.goal_id = goal_id
        """16 bytes."""
        self.accepted: bool | None = None
        """None until the server has answered."""
        self.status: int = GoalStatus.STATUS_UNKNOWN
        """A constant of action_msgs/GoalStatus, as the server last told."""
        self.result: Any = None
        """The result message once done; None if the goal was rejected or the server is gone."""
        self.error: str | None = None
        """Why there is no result."""
        self.done = False
        """Whether nothing will change any more: a result, a rejection or an error."""
        self.held = False
        """Whether it waits for who holds goals back (`Bus.hold_goal`)."""
        self._client = client

    @property
    def succeeded(self) -> bool:
        """Whether the goal ended with success."""
        return self.status == GoalStatus.STATUS_SUCCEEDED

    def cancel(self) -> Future:
        """Ask the server to end the goal; the future's result is a CancelGoal response."""
        return self._client.cancel(self)

    def __iter__(self) -> Generator[None, None, ClientGoal]:
        """Wait in an execution."""
        while not self.done:
            yield
        return self


class _Sent(NamedTuple):
    """A goal that has not ended."""

    goal: ClientGoal
    message: Any
    time_ns: int
    """When it was sent [ns]."""
    feedback: Callable[[Any], None] | None


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
        self._goals: dict[bytes, _Sent] = {}
        self._count = 0
        self.node = node
        """Whose client it is."""
        self._destroyed = False
        node.action_clients.append(self)
        # Not the gid: that depends on what other nodes have created before.
        self._seed = f"{node.bus.session_id}{node.fully_qualified_name}#{len(node.action_clients)}".encode()
        base = f"{self.name}/_action"
        self._send = node.create_client(action_type.SendGoal, f"{base}/send_goal")
        self._cancel = node.create_client(CancelGoal, f"{base}/cancel_goal")
        self._result = node.create_client(action_type.GetResult, f"{base}/get_result")
        feedback = node.resolve_name(f"{base}/feedback")
        self._subscriptions: tuple[Subscription[Any], ...] = (
            node.add_endpoint(
                Subscription(
                    node,
                    f"{action_type.name}_FeedbackMessage",
                    feedback,
                    self._on_feedback,
                    as_qos(10),
                    wanted=self._wants_feedback,
                )
            ),
            node.create_subscription(GoalStatusArray, f"{base}/status", self._on_status, LATCHED),
        )

    @property
    def server_is_ready(self) -> bool:
        """Whether somebody offers the action now."""
        return self._send.service_is_ready

    def wait_for_server(self, timeout_ns: int | None = None) -> Generator[None, None, bool]:
        """Wait in an execution, as `Client.wait_for_service`."""
        return (yield from self._send.wait_for_service(timeout_ns))

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
        self._goals[goal_id] = _Sent(client_goal, goal, self.node.now_ns, feedback_callback)
        hold = self.node.bus.hold_goal
        client_goal.held = hold is not None and hold(self, client_goal, goal)
        if not client_goal.held:
            self.post(client_goal, goal)
        return client_goal

    def post(self, client_goal: ClientGoal, goal: Any) -> None:
        """Send the message of a goal to the server: of one that was held back, now."""
        client_goal.held = False
        request = self._type.SendGoal.Request(uuid_msg(client_goal.goal_id), goal)
        self._send.call_async(request).add_done_callback(lambda f: self._on_accepted(client_goal, f))

    def post_again(self, revised: Callable[[Any, int], Any]) -> None:
        """Send the goals that have not ended to the server that has taken the place of theirs.

        Args:
            revised: Returns what is sent instead of a goal's message of so long ago [ns].
        """
        for sent in tuple(self._goals.values()):
            if not sent.goal.held:
                self.post(sent.goal, revised(sent.message, self.node.now_ns - sent.time_ns))

    def answer(self, goal: ClientGoal, status: int, result: Any = None) -> None:
        """End a goal that was held back instead of the server, which never hears of it.

        Args:
            goal: The goal.
            status: A constant of action_msgs/GoalStatus.
            result: The result message; None: all its defaults.
        """
        goal.held, goal.accepted, goal.status = False, True, status
        goal.result = new(self._type.Result) if result is None else result
        self._finish(goal, None)

    def cancel(self, goal: ClientGoal) -> Future:
        """Ask the server to end a goal; one that was held back ends at once."""
        if goal.held:
            self.answer(goal, GoalStatus.STATUS_CANCELED)
        return self._ask_to_cancel(goal.goal_id, 0)

    def cancel_all(self) -> Future:
        """Ask the server to end all goals, those of other clients too."""
        return self._ask_to_cancel(bytes(16), 0)

    def cancel_before(self, time_ns: int) -> Future:
        """Ask the server to end all goals accepted until a time [ns] above zero, of other clients too."""
        return self._ask_to_cancel(bytes(16), time_ns)

    def get_result(self, goal_id: bytes) -> Future:
        """Ask for the result of any goal; the future's result is a GetResult response with status and result.

        The status is UNKNOWN, and the result empty, if the server does not know the goal (any more).
        """
        return self._result.call_async(self._type.GetResult.Request(uuid_msg(goal_id)))

    def destroy(self) -> None:
        """Be a client no more: goals that are not done end with an error. Harmless when repeated."""
        self._destroyed = True
        for client in (self._send, self._cancel, self._result):
            self.node.destroy_client(client)
        for subscription in self._subscriptions:
            self.node.destroy_subscription(subscription)

    def _ask_to_cancel(self, goal_id: bytes, until_ns: int) -> Future:
        return self._cancel.call_async(CancelGoal.Request(GoalInfo(uuid_msg(goal_id), stamp(until_ns))))

    def _on_accepted(self, goal: ClientGoal, future: Future) -> None:
        if future.error is not None:
            goal.accepted = False
            self._finish(
                goal, self._why(f"no server of the action {self.name} answered; is its node running?")
            )
            return
        goal.accepted = bool(future.result.accepted)
        if not goal.accepted:
            self._finish(goal, f"the action {self.name} rejected the goal")
            return
        if goal.status == GoalStatus.STATUS_UNKNOWN:
            goal.status = GoalStatus.STATUS_ACCEPTED
        self.get_result(goal.goal_id).add_done_callback(lambda f: self._on_result(goal, f))

    def _on_result(self, goal: ClientGoal, future: Future) -> None:
        if future.error is not None:
            goal.status = GoalStatus.STATUS_UNKNOWN
            why = f"the server of the action {self.name} went away before the goal had ended"
            self._finish(goal, self._why(why))
            return
        goal.status = int(future.result.status)
        if goal.status == GoalStatus.STATUS_UNKNOWN:
            self._finish(goal, f"the server of the action {self.name} does not know the goal any more")
            return
        goal.result = future.result.result
        self._finish(goal, None)

    def _why(self, reason: str) -> str:
        return f"the client of the action {self.name} was destroyed" if self._destroyed else reason

    def _finish(self, goal: ClientGoal, error: str | None) -> None:
        goal.error = error
        goal.done = True
        self._goals.pop(goal.goal_id, None)

    def _wants_feedback(self, payload: bytes) -> bool:
        """Whether somebody waits for it: every client hears that of all clients' goals."""
        sent = self._goals.get(payload[_GOAL_ID])
        return sent is not None and sent.feedback is not None

    def _on_feedback(self, message: Any) -> None:
        sent = self._goals.get(bytes(message.goal_id.uuid))
        if sent is not None and sent.feedback is not None:
            sent.feedback(message.feedback)

    def _on_status(self, message: GoalStatusArray) -> None:
        for entry in message.status_list:
            sent = self._goals.get(bytes(entry.goal_info.goal_id.uuid))
            if sent is not None and entry.status in ACTIVE:  # the end comes with the result
                sent.goal.status = int(entry.status)
