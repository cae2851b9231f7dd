"""One goal of `dock_robot` or `undock_robot`: its states, its error codes, how it is doing."""

from __future__ import annotations

from typing import Any

from twin.bridge.action_types import DockRobot, UndockRobot
from twin.bridge.actions import GoalHandle
from twin.bridge.msgs import duration, new

FAILED_TO_STAGE, FAILED_TO_DETECT_DOCK, FAILED_TO_CONTROL, FAILED_TO_CHARGE = 903, 904, 905, 906
"""Error codes of opennav_docking's results; `DockDatabase` has the others."""
STAGING, PERCEPTION, CONTROLLING, WAITING, RETRY = 1, 2, 3, 4, 5
"""States in the feedback."""


class Cancelled(Exception):
    """A client wants the goal to end."""


class Attempt:
    """One goal of either action."""

    def __init__(self, handle: GoalHandle, began_ns: int) -> None:
        self.handle, self._began_ns = handle, began_ns
        self.retries = 0

    def check(self) -> None:
        """Raise `Cancelled` if a client wants the end."""
        if self.handle.is_cancel_requested:
            raise Cancelled

    def tell(self, state: int, now_ns: int) -> None:
        """Publish feedback; undocking has none that says anything."""
        self.check()
        if isinstance(self.handle.request, DockRobot.Goal):
            time = duration(now_ns - self._began_ns)
            self.handle.publish_feedback(
                new(DockRobot.Feedback, state=state, docking_time=time, num_retries=self.retries)
            )

    def result(self, error_code: int = 0, reason: str = "") -> Any:
        """Return the action's result; without an error code it is a success."""
        told = {"success": not error_code, "error_code": error_code, "error_msg": reason}
        if isinstance(self.handle.request, DockRobot.Goal):
            return new(DockRobot.Result, num_retries=self.retries, **told)
        return new(UndockRobot.Result, **told)
