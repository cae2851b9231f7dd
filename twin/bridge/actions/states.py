"""The states of a goal and what moves it from one to the next (rcl_action, goal_state_machine.c)."""

from __future__ import annotations

from enum import Enum

from twin.bridge.msgs import GoalStatus
from twin.errors import BridgeError


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
