"""Action servers: goals executed by generators that spins advance."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

from twin.bridge.actions.goal import Execute, GoalEvent, GoalHandle, is_cancelable, transition, uuid_msg
from twin.bridge.msgs import GoalStatus, GoalStatusArray, ns, stamp
from twin.bridge.node import tasks
from twin.bridge.qos import LATCHED, as_qos
from twin.bridge.services import Respond
from twin.bridge.srvs import CancelGoal
from twin.bridge.topics import Publisher
from twin.bridge.types import ActionType
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

Policy = Literal["preempt", "parallel", "queue", "reject"]

_KEPT_GOALS = 16
"""rcl keeps all until they expire; every status message would list them."""


class _Ended(NamedTuple):
    """What get_result answers for a goal that has ended."""

    status: int
    result: Any
    time_ns: int


@dataclass(eq=False)
class _Run:
    """A goal being executed."""

    handle: GoalHandle
    generator: tasks.Steps
    due_ns: int = 0


class ActionServer:
    """Offers an action."""

    def __init__(
        self,
        node: Node,
        action_type: ActionType,
        name: str,
        execute: Execute,
        goal_callback: Callable[[Any], Any] = lambda goal: True,
        cancel_callback: Callable[[GoalHandle], Any] = lambda handle: True,
        *,
        policy: Policy = "preempt",
        handle_accepted_callback: Callable[[GoalHandle], None] = GoalHandle.execute,
        result_timeout_ns: int = 900_000_000_000,
    ) -> None:
        """Offer an action.

        Args:
            node: Whose spin executes.
            action_type: From `action_types`.
            name: Of the action, relative to the node's namespace.
            execute: Generator function of the goal handle. When it returns, the goal has succeeded unless it
                said something else.
            goal_callback: Takes the goal message; False or GoalResponse.REJECT rejects it.
            cancel_callback: Takes the goal handle; False or CancelResponse.REJECT refuses to cancel.
            policy: What becomes of a goal while another one is active. preempt: the old one ends as aborted;
                parallel: all are executed, as by rclpy; queue: one after the other; reject: it is rejected.
            handle_accepted_callback: Takes the goal handle and calls its `execute`, at once or later.
            result_timeout_ns: How long the result of a goal that has ended can be asked for [ns]; rclpy's.

        Raises:
            BridgeError: an invalid name or policy.
        """
        if policy not in get_args(Policy):
            raise BridgeError(f"{policy!r} is no policy; valid: {', '.join(get_args(Policy))}")
        self.name = node.resolve_name(name)
        """Absolute name of the action."""
        self._node, self._type, self._policy = node, action_type, policy
        self._clock = node.get_clock()
        self._execute = execute
        self._goal_callback, self._cancel_callback = goal_callback, cancel_callback
        self._accepted_callback = handle_accepted_callback
        self._result_timeout_ns = result_timeout_ns
        self._handles: OrderedDict[bytes, GoalHandle] = OrderedDict()
        self._running: list[_Run] = []
        self._queue: deque[tuple[GoalHandle, Execute]] = deque()
        self._ended: OrderedDict[bytes, _Ended] = OrderedDict()
        self._forget_ns = tasks.NEVER_NS
        """When the first of them can be forgotten [ns]."""
        self._waiting: dict[bytes, list[Respond]] = {}
        self._closed = False
        base = f"{self.name}/_action"
        feedback = f"{action_type.name}_FeedbackMessage"
        self._feedback: Publisher[Any] = node.add_endpoint(
            Publisher(node, feedback, node.resolve_name(f"{base}/feedback"), as_qos(10))
        )
        self._status = node.create_publisher(GoalStatusArray, f"{base}/status", LATCHED)
        self._services = (
            node.create_deferred_service(action_type.SendGoal, f"{base}/send_goal", self._on_goal),
            node.create_service(CancelGoal, f"{base}/cancel_goal", self._on_cancel),
            node.create_deferred_service(action_type.GetResult, f"{base}/get_result", self._on_result),
        )
        node.add_execution(self)

    @property
    def current(self) -> GoalHandle | None:
        """The goal being executed, the oldest one of several."""
        return self._running[0].handle if self._running else None

    @property
    def goals(self) -> tuple[GoalHandle, ...]:
        """The goals that have not ended, in the order of acceptance."""
        return tuple(handle for handle in self._handles.values() if handle.is_active)

    @property
    def _is_closed(self) -> bool:
        return self._closed or self._node.is_destroyed

    @property
    def due_ns(self) -> int:
        """When `step` has something to do, if nothing arrives before [ns]."""
        if self._running:
            return min([run.due_ns for run in self._running])
        return self._forget_ns

    def step(self) -> bool:
        """Advance every execution to its next yield; an exception in one is a bug and propagates.

        Returns:
            False: the server stays, whatever there is to do.
        """
        if self._running:
            self._advance()
        if self._queue and not self._running:
            self._start(*self._queue.popleft())
        while self._clock.now_ns >= self._forget_ns:
            self._forget(next(iter(self._ended)))
        return False

    def _advance(self) -> None:
        for run in tuple(self._running):
            if run not in self._running:
                continue
            try:
                run.due_ns = next(run.generator) or 0
            except StopIteration as end:
                self._return(run, end.value)
            if run not in self._running:  # it ended itself, by destroying its node
                tasks.close(run.generator)

    def publish_feedback(self, handle: GoalHandle, feedback: Any) -> None:
        """Publish feedback of a goal; nothing after the server's end.

        Raises:
            TypeError: another message.
        """
        if type(feedback) is not self._type.Feedback:
            what = type(feedback).__name__
            raise TypeError(f"{self.name} gives {self._type.name}_Feedback, not {what}")
        if not self._is_closed:
            self._feedback.publish(self._type.FeedbackMessage(uuid_msg(handle.goal_id), feedback))

    def execute_goal(self, handle: GoalHandle, execute: Execute | None) -> None:
        """Execute an accepted goal, or queue it; see `GoalHandle.execute`."""
        self._node.wake()
        if self._policy == "queue" and (self._running or self._queue):
            self._queue.append((handle, execute or self._execute))
        else:
            self._start(handle, execute or self._execute)

    def update(self, handle: GoalHandle, event: GoalEvent) -> None:
        """Move a goal to its next state and tell everybody.

        Raises:
            BridgeError: invalid in the goal's state.
        """
        if self._is_closed:
            return
        handle.status = transition(handle.status, event)
        self._publish_status()
        if not handle.is_active and not any(run.handle is handle for run in self._running):
            self._end(handle, None)

    def close(self) -> None:
        """End every goal as aborted; generators are closed where they wait."""
        for handle in self.goals:
            self._abort(handle)

    def destroy(self) -> None:
        """Offer the action no more. Harmless when repeated."""
        self.close()
        self._closed = True
        self._node.remove_execution(self)
        for service in self._services:
            self._node.destroy_service(service)
        self._node.destroy_publisher(self._feedback)
        self._node.destroy_publisher(self._status)

    def _on_goal(self, request: Any, respond: Respond) -> None:
        goal_id = bytes(request.goal_id.uuid)
        now_ns = self._node.now_ns
        busy = self._policy == "reject" and bool(self.goals)
        accepted = not busy and goal_id not in self._handles and bool(self._goal_callback(request.goal))
        if not accepted:
            respond(self._type.SendGoal.Response(False, stamp(now_ns)))
            return
        if self._policy == "preempt":
            self.close()
        handle = self._handles[goal_id] = GoalHandle(self, goal_id, request.goal, now_ns)
        self._publish_status()
        # First the answer, then perhaps feedback: as in rclpy.
        respond(self._type.SendGoal.Response(True, stamp(now_ns)))
        self._accepted_callback(handle)

    def _start(self, handle: GoalHandle, execute: Execute) -> None:
        if not handle.is_cancel_requested:  # an execution answers a cancel that came before it
            self.update(handle, GoalEvent.EXECUTE)
        outcome = execute(handle)
        if not isinstance(outcome, Generator):
            raise TypeError(f"the execution of {self.name} is no generator function; it has no yield")
        self._running.append(_Run(handle, outcome))

    def _return(self, run: _Run, result: Any) -> None:
        if result is not None and type(result) is not self._type.Result:
            raise TypeError(f"{self.name} ends with {self._type.name}_Result, not {type(result).__name__}")
        if run not in self._running:
            return
        if run.handle.is_active:
            self.update(run.handle, GoalEvent.SUCCEED)
        self._running.remove(run)
        self._end(run.handle, result)

    def _abort(self, handle: GoalHandle) -> None:
        """End an active goal from outside of its execution."""
        self._queue = deque(entry for entry in self._queue if entry[0] is not handle)
        for run in tuple(self._running):
            if run.handle is handle:
                self._running.remove(run)
                tasks.close(run.generator)
        if handle.status == GoalStatus.STATUS_ACCEPTED:
            handle.status = transition(handle.status, GoalEvent.EXECUTE)
        if handle.is_active:  # its `finally` may have ended it
            self.update(handle, GoalEvent.ABORT)

    def _on_cancel(self, request: Any) -> Any:
        code, chosen = self._chosen(request.goal_info)
        canceling = [handle for handle in chosen if self._cancel_callback(handle)]
        for handle in tuple(canceling):
            if not is_cancelable(handle.status):  # ended by the callback
                canceling.remove(handle)
                continue
            self.update(handle, GoalEvent.CANCEL_GOAL)
            if any(entry[0] is handle for entry in self._queue):
                self._queue = deque(entry for entry in self._queue if entry[0] is not handle)
                self.update(handle, GoalEvent.CANCELED)
        if chosen and not canceling:
            code = CancelGoal.Response.ERROR_REJECTED
        return CancelGoal.Response(code, [handle.info for handle in canceling])

    def _chosen(self, info: Any) -> tuple[int, list[GoalHandle]]:
        """Choose as rcl_action_process_cancel_request: by id, by time of acceptance, all if both are zero."""
        wanted, until_ns = bytes(info.goal_id.uuid), ns(info.stamp)
        codes = CancelGoal.Response
        if any(wanted) and until_ns == 0:
            handle = self._handles.get(wanted)
            if handle is None:
                return codes.ERROR_UNKNOWN_GOAL_ID, []
            if not is_cancelable(handle.status):
                return codes.ERROR_GOAL_TERMINATED, []
            return codes.ERROR_NONE, [handle]
        until_ns = until_ns or tasks.NEVER_NS
        return codes.ERROR_NONE, [
            handle
            for handle in self._handles.values()
            if is_cancelable(handle.status) and (handle.accepted_ns <= until_ns or handle.goal_id == wanted)
        ]

    def _on_result(self, request: Any, respond: Respond) -> None:
        goal_id = bytes(request.goal_id.uuid)
        ended = self._ended.get(goal_id)
        if ended is not None:
            respond(self._type.GetResult.Response(ended.status, ended.result))
        elif goal_id in self._handles:
            self._waiting.setdefault(goal_id, []).append(respond)
        else:
            respond(self._type.GetResult.Response(GoalStatus.STATUS_UNKNOWN, new(self._type.Result)))

    def _end(self, handle: GoalHandle, result: Any) -> None:
        result = new(self._type.Result) if result is None else result
        self._ended[handle.goal_id] = _Ended(handle.status, result, self._node.now_ns)
        self._note_oldest()
        self._node.wake()
        for respond in self._waiting.pop(handle.goal_id, ()):
            respond(self._type.GetResult.Response(handle.status, result))
        if len(self._ended) > _KEPT_GOALS:
            self._forget(next(iter(self._ended)))

    def _forget(self, goal_id: bytes) -> None:
        del self._ended[goal_id], self._handles[goal_id]
        self._note_oldest()

    def _note_oldest(self) -> None:
        oldest = next(iter(self._ended.values()), None)
        self._forget_ns = oldest.time_ns + self._result_timeout_ns + 1 if oldest else tasks.NEVER_NS

    def _publish_status(self) -> None:
        handles = self._handles.values()
        self._status.publish(GoalStatusArray([GoalStatus(h.info, h.status) for h in handles]))
