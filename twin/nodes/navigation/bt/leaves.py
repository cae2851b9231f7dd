"""Leaves that do the work: call an action or a service, test a condition."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from twin.bridge.actions import ActionClient, ClientGoal
from twin.bridge.services import Client, Future


class CallAction(Behaviour):
    """Sends a goal and waits for its result; cancels it when halted (Nav2's `BtActionNode`).

    Args:
        name: Shown in logs and in the recording.
        client: Of the action.
        goal: Makes the goal at the start; returns None if it cannot, after saying why, and the leaf fails.
        on_result: Takes the result of a goal that succeeded; a returned text is a reason to fail after all.
        on_failure: Takes the text that says why it failed.
    """

    def __init__(
        self,
        name: str,
        client: ActionClient,
        goal: Callable[[], Any | None],
        *,
        on_result: Callable[[Any], str | None] | None = None,
        on_failure: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__(name)
        self._client = client
        self._make_goal = goal
        self._on_result = on_result
        self._on_failure = on_failure
        self._goal: ClientGoal | None = None

    def initialise(self) -> None:
        """Send the goal."""
        goal = self._make_goal()
        self._goal = None if goal is None else self._client.send_goal(goal)

    def update(self) -> Status:
        """Look whether the result is there."""
        if self._goal is None:
            self.feedback_message = "no goal could be made"
            return Status.FAILURE
        if self._goal.accepted is False:
            return self._fail(self._goal.error or f"{self._client.name} rejected the goal")
        if not self._goal.done:
            return Status.RUNNING
        if not self._goal.succeeded:
            text = getattr(self._goal.result, "error_msg", "") or getattr(
                self._goal.result, "error_string", ""
            )
            return self._fail(text or f"{self._client.name} was aborted")
        reason = self._on_result(self._goal.result) if self._on_result else None
        return Status.SUCCESS if reason is None else self._fail(reason)

    def terminate(self, new_status: Status) -> None:
        """Cancel the goal when halted."""
        if new_status == Status.INVALID and self._goal is not None and not self._goal.done:
            self._goal.cancel()
        if new_status == Status.INVALID:
            self._goal = None

    def _fail(self, reason: str) -> Status:
        self.feedback_message = reason
        if self._on_failure is not None:
            self._on_failure(f"{self.name}: {reason}")
        return Status.FAILURE


class CallService(Behaviour):
    """Calls a service and waits for the answer (Nav2's `BtServiceNode`)."""

    def __init__(
        self,
        name: str,
        client: Client,
        request: Callable[[], Any],
        accept: Callable[[Any], bool] = lambda response: True,
    ) -> None:
        super().__init__(name)
        self._client = client
        self._request = request
        self._accept = accept
        self._future: Future | None = None

    def initialise(self) -> None:
        """Send the request."""
        self._future = self._client.call_async(self._request())

    def update(self) -> Status:
        """Look whether the answer is there."""
        assert self._future is not None
        if not self._future.done:
            return Status.RUNNING
        if self._future.error is not None:
            self.feedback_message = self._future.error
            return Status.FAILURE
        return Status.SUCCESS if self._accept(self._future.result) else Status.FAILURE


class Condition(Behaviour):
    """Succeeds while `test` holds."""

    def __init__(self, name: str, test: Callable[[], bool]) -> None:
        super().__init__(name)
        self._test = test

    def update(self) -> Status:
        """Ask."""
        return Status.SUCCESS if self._test() else Status.FAILURE


class Do(Behaviour):
    """Does something that is over at once; a returned text is the reason why it failed."""

    def __init__(self, name: str, action: Callable[[], str | None]) -> None:
        super().__init__(name)
        self._action = action

    def update(self) -> Status:
        """Do it."""
        reason = self._action()
        if reason is None:
            return Status.SUCCESS
        self.feedback_message = reason
        return Status.FAILURE
