"""Actions: `ActionServer`, `ActionClient` and the goals as each side sees them."""

from __future__ import annotations

from twin.bridge.actions.client import ActionClient, ClientGoal
from twin.bridge.actions.goal import CancelResponse, Execute, GoalHandle, GoalResponse
from twin.bridge.actions.server import ActionServer

__all__ = [
    "ActionClient",
    "ActionServer",
    "CancelResponse",
    "ClientGoal",
    "Execute",
    "GoalHandle",
    "GoalResponse",
]
