"""Actions: `ActionServer`, `ActionClient` and the goals as each side sees them."""

from __future__ import annotations

from twin.bridge.action_client import ActionClient, ClientGoal
from twin.bridge.action_server import ActionServer, GoalHandle

__all__ = ["ActionClient", "ActionServer", "ClientGoal", "GoalHandle"]
