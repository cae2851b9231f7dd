"""A goal as its action server's callbacks see it, its states, and what moves it from one to the next.

Source of the states: rcl_action, goal_state_machine.c.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.bridge.msgs import UUID, GoalInfo, GoalStatus, stamp
from twin.bridge.node.tasks import Steps
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.actions.server import ActionServer


class GoalEvent(Enum):
    """What happens to a goal."""

    EXECUTE = "execute"
    CANCEL_GOAL = "cancel_goal"
    SUCCEED = "succeed"
    ABORT = "abort"
    CANCELED = "canceled"


TRANSITIONS: dict[tuple[int, GoalEvent], int] = {
    (GoalStatus.STATUS_ACCEPTED, GoalEvent.EXECUTE): GoalStatus.STATUS_EXECUTING,
    (GoalStatus.STATUS_ACCEPTED, GoalEvent.CANCEL_GOAL): GoalStatus.STATUS_CANCELING,
    (GoalStatus.STATUS_EXECUTING, GoalEvent.CANCEL_GOAL): GoalStatus.STATUS_CANCELING,
    (GoalStatus.STATUS_EXECUTING, GoalEvent.SUCCEED): GoalStatus.STATUS_SUCCEEDED,
    (GoalStatus.STATUS_EXECUTING, GoalEvent.ABORT): GoalStatus.STATUS_ABORTED,
    (GoalStatus.STATUS_CANCELING, GoalEvent.SUCCEED): GoalStatus.STATUS_SUCCEEDED,
    (GoalStatus.STATUS_CANCELING, GoalEvent.ABORT): GoalStatus.STATUS_ABORTED,
    (GoalStatus.STATUS_CANCELING, GoalEvent.CANCELED): GoalStatus.STATUS_CANCELED,
}
"""State and event -> next state; every other pair is invalid."""

ACTIVE = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)

NAMES: dict[int, str] = {
    GoalStatus.STATUS_UNKNOWN: "UNKNOWN",
    GoalStatus.STATUS_ACCEPTED: "ACCEPTED",
    GoalStatus.STATUS_EXECUTING: "EXECUTING",
    GoalStatus.STATUS_CANCELING: "CANCELING",
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}


def is_cancelable(status: int) -> bool:
    """Return whether a goal in this state may be asked to end."""
    return (status, GoalEvent.CANCEL_GOAL) in TRANSITIONS


def transition(status: int, event: GoalEvent) -> int:
    """Return the next state.

    Raises:
        BridgeError: the event is invalid in this state.
    """
    following = TRANSITIONS.get((status, event))
    if following is None:
        valid = ", ".join(e.value for s, e in TRANSITIONS if s == status) or "none, it has ended"
        raise BridgeError(f"a goal that is {NAMES[status]} cannot {event.value}; valid: {valid}")
    return following


Execute = Callable[["GoalHandle"], Steps]
"""Executes a goal; the return value is the result message."""


class _Answer:
    """Enums are true whatever their value; rclpy's answers are not to be."""

    value: int

    def __bool__(self) -> bool:
        return self.value == 2


class GoalResponse(_Answer, Enum):
    """What a goal callback answers; True and False do as well."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(_Answer, Enum):
    """What a cancel callback answers; True and False do as well."""

    REJECT = 1
    ACCEPT = 2


class GoalHandle:
    """An accepted goal."""

    def __init__(self, server: ActionServer, goal_id: bytes, request: Any, accepted_ns: int) -> None:
        self.request = request
        """The goal message."""
        self.goal_id = goal_id
        """16 bytes."""
        self.accepted_ns = accepted_ns
        self.status: int = GoalStatus.STATUS_ACCEPTED
        """A constant of action_msgs/GoalStatus."""
        self._server = server

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended yet."""
        return self.status in ACTIVE

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a client wants the goal to end; answer with `canceled()` and return."""
        return self.status == GoalStatus.STATUS_CANCELING

    @cached_property  # every status message lists the last goals
    def info(self) -> GoalInfo:
        """Id and time of acceptance."""
        return GoalInfo(uuid_msg(self.goal_id), stamp(self.accepted_ns))

    def execute(self, execute: Execute | None = None) -> None:
        """Start the execution; only for servers with a `handle_accepted_callback`.

        Args:
            execute: Instead of the server's.
        """
        self._server.execute_goal(self, execute)

    def succeed(self) -> None:
        """End with success; the result is what the execution returns. The default when it returns.

        Raises:
            BridgeError: the goal has ended before, or is not executed yet.
        """
        self._server.update(self, GoalEvent.SUCCEED)

    def abort(self) -> None:
        """End as failed; the result is what the execution returns.

        Raises:
            BridgeError: the goal has ended before, or is not executed yet.
        """
        self._server.update(self, GoalEvent.ABORT)

    def canceled(self) -> None:
        """End as cancelled; the result is what the execution returns.

        Raises:
            BridgeError: no client wants it, or the goal has ended before.
        """
        self._server.update(self, GoalEvent.CANCELED)

    def publish_feedback(self, feedback: Any) -> None:
        """Tell the client how far it is; `feedback` is the action's Feedback message.

        Raises:
            TypeError: another message.
        """
        self._server.publish_feedback(self, feedback)


def uuid_msg(goal_id: bytes) -> UUID:
    """Return a goal's id as a message."""
    return UUID(np.frombuffer(goal_id, np.uint8))
