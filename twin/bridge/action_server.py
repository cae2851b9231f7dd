"""Action servers: one goal at a time, executed by a generator that each spin advances."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from twin.bridge.defaults import new
from twin.bridge.msgs import UUID, GoalInfo, GoalStatus, GoalStatusArray, ns, stamp
from twin.bridge.qos import LATCHED
from twin.bridge.services import Respond
from twin.bridge.srvs import CancelGoal
from twin.bridge.types import ActionType

if TYPE_CHECKING:
    from twin.bridge.node import Node

Execute = Callable[["GoalHandle"], Generator[None, None, Any]]
"""Executes a goal: each yield waits for the next spin, the return value is the result message."""

_KEPT_GOALS = 8
_ACTIVE = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)


class GoalHandle:
    """An accepted goal, as its execution sees it."""

    def __init__(self, server: ActionServer, goal_id: bytes, request: Any, accepted_ns: int) -> None:
        self.request = request
        """The goal message."""
        self.goal_id = goal_id
        """16 bytes."""
        self.accepted_ns = accepted_ns
        self.status: int = GoalStatus.STATUS_ACCEPTED
        """A constant of action_msgs/GoalStatus."""
        self.outcome: int = GoalStatus.STATUS_SUCCEEDED
        """The status to end with when the execution returns."""
        self._server = server

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended yet."""
        return self.status in _ACTIVE

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a client wants the goal to end; answer with `canceled()` and return."""
        return self.status == GoalStatus.STATUS_CANCELING

    def succeed(self) -> None:
        """End with success when the execution returns; the default."""
        self.outcome = GoalStatus.STATUS_SUCCEEDED

    def abort(self) -> None:
        """End as failed when the execution returns."""
        self.outcome = GoalStatus.STATUS_ABORTED

    def canceled(self) -> None:
        """End as cancelled when the execution returns."""
        self.outcome = GoalStatus.STATUS_CANCELED

    def publish_feedback(self, feedback: Any) -> None:
        """Tell the client how far it is; `feedback` is the action's Feedback message."""
        self._server.publish_feedback(self, feedback)


class _Ended(NamedTuple):
    """What get_result answers for a goal that has ended."""

    status: int
    result: Any


class ActionServer:
    """Offers an action. A goal accepted while another one runs preempts it: the old one ends as aborted."""

    def __init__(
        self,
        node: Node,
        action_type: ActionType,
        name: str,
        execute: Execute,
        goal_callback: Callable[[Any], bool] = lambda goal: True,
        cancel_callback: Callable[[GoalHandle], bool] = lambda handle: True,
    ) -> None:
        """Offer an action.

        Args:
            node: Whose spin executes.
            action_type: From `action_types`.
            name: Of the action, relative to the node's namespace.
            execute: Generator function of the goal handle.
            goal_callback: Takes the goal message; False rejects it.
            cancel_callback: Takes the goal handle; False refuses to cancel.

        Raises:
            BridgeError: an invalid name.
        """
        self._node = node
        self._type = action_type
        self._execute = execute
        self._goal_callback = goal_callback
        self._cancel_callback = cancel_callback
        self._current: tuple[GoalHandle, Generator[None, None, Any]] | None = None
        self._handles: OrderedDict[bytes, GoalHandle] = OrderedDict()
        self._ended: OrderedDict[bytes, _Ended] = OrderedDict()
        self._waiting: dict[bytes, list[Respond]] = {}
        base = f"{node.resolve_name(name)}/_action"
        self._feedback = node.create_publisher(action_type.FeedbackMessage, f"{base}/feedback")
        self._status = node.create_publisher(GoalStatusArray, f"{base}/status", LATCHED)
        node.create_service(action_type.SendGoal, f"{base}/send_goal", self._on_goal)
        node.create_service(CancelGoal, f"{base}/cancel_goal", self._on_cancel)
        node.create_deferred_service(action_type.GetResult, f"{base}/get_result", self._on_result)
        node.add_execution(self)

    @property
    def current(self) -> GoalHandle | None:
        """The goal being executed."""
        return self._current[0] if self._current else None

    def step(self) -> None:
        """Advance the execution to its next yield; an exception in it is a bug and propagates."""
        if self._current is None:
            return
        handle, execution = self._current
        if handle.status == GoalStatus.STATUS_ACCEPTED:
            self._set_status(handle, GoalStatus.STATUS_EXECUTING)
        try:
            next(execution)
        except StopIteration as end:
            self._current = None
            self._end(handle, handle.outcome, end.value)

    def publish_feedback(self, handle: GoalHandle, feedback: Any) -> None:
        """Publish feedback of a goal."""
        self._feedback.publish(self._type.FeedbackMessage(_uuid(handle.goal_id), feedback))

    def close(self) -> None:
        """End the current goal, if there is one, as aborted; its generator is closed where it waits."""
        if self._current is not None:
            handle, execution = self._current
            self._current = None
            execution.close()
            self._end(handle, GoalStatus.STATUS_ABORTED, None)

    def _on_goal(self, request: Any) -> Any:
        goal_id = bytes(request.goal_id.uuid)
        now_ns = self._node.now_ns
        accepted = goal_id not in self._handles and bool(self._goal_callback(request.goal))
        if accepted:
            self.close()
            handle = GoalHandle(self, goal_id, request.goal, now_ns)
            self._handles[goal_id] = handle
            self._current = (handle, self._execute(handle))
            self._publish_status()
        return self._type.SendGoal.Response(accepted, stamp(now_ns))

    def _on_cancel(self, request: Any) -> Any:
        """Choose as action_msgs/srv/CancelGoal says: by id, by time of acceptance, all if both are zero."""
        wanted = bytes(request.goal_info.goal_id.uuid)
        until_ns = ns(request.goal_info.stamp)
        everything = not any(wanted) and until_ns == 0
        chosen = [
            handle
            for handle in self._handles.values()
            if everything or handle.goal_id == wanted or (until_ns and handle.accepted_ns <= until_ns)
        ]
        active = [handle for handle in chosen if handle.is_active]
        canceling = [handle for handle in active if self._cancel_callback(handle)]
        for handle in canceling:
            self._set_status(handle, GoalStatus.STATUS_CANCELING)
        response = CancelGoal.Response
        if canceling:
            code = response.ERROR_NONE
        elif active:
            code = response.ERROR_REJECTED
        elif chosen:
            code = response.ERROR_GOAL_TERMINATED
        else:
            code = response.ERROR_UNKNOWN_GOAL_ID
        return response(code, [_info(handle) for handle in canceling])

    def _on_result(self, request: Any, respond: Respond) -> None:
        goal_id = bytes(request.goal_id.uuid)
        handle = self._handles.get(goal_id)
        if handle is not None and handle.is_active:
            self._waiting.setdefault(goal_id, []).append(respond)
            return
        unknown = _Ended(GoalStatus.STATUS_UNKNOWN, new(self._type.Result))
        respond(self._type.GetResult.Response(*self._ended.get(goal_id, unknown)))

    def _end(self, handle: GoalHandle, status: int, result: Any) -> None:
        ended = _Ended(status, new(self._type.Result) if result is None else result)
        self._ended[handle.goal_id] = ended
        self._set_status(handle, status)
        for respond in self._waiting.pop(handle.goal_id, ()):
            respond(self._type.GetResult.Response(*ended))
        while len(self._ended) > _KEPT_GOALS:
            forgotten, _ = self._ended.popitem(last=False)
            del self._handles[forgotten]

    def _set_status(self, handle: GoalHandle, status: int) -> None:
        handle.status = status
        self._publish_status()

    def _publish_status(self) -> None:
        handles = self._handles.values()
        self._status.publish(GoalStatusArray([GoalStatus(_info(h), h.status) for h in handles]))


def _uuid(goal_id: bytes) -> UUID:
    return UUID(np.frombuffer(goal_id, np.uint8))


def _info(handle: GoalHandle) -> GoalInfo:
    return GoalInfo(_uuid(handle.goal_id), stamp(handle.accepted_ns))
