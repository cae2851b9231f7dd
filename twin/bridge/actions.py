"""Actions: `ActionServer`, `ActionClient` and the goals as each side sees them."""

from __future__ import annotations

from twin.bridge.action_client import ActionClient, ClientGoal
from twin.bridge.action_goal import CancelResponse, GoalHandle, GoalResponse
from twin.bridge.action_server import ActionServer

__all__ = ["ActionClient", "ActionServer", "CancelResponse", "ClientGoal", "GoalHandle", "GoalResponse"]
