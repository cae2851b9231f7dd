"""Why navigation could not do what was asked, with the error codes of Nav2's actions.

These end an action with an error code: answers of the robot, not mistakes of the user (`twin.errors`).
"""

from __future__ import annotations


class NavigationFailure(Exception):
    """Base: `error_code` is the one of the nav2_msgs action that reports it."""

    error_code: int = 0

    def __init_subclass__(cls, *, error_code: int | None = None) -> None:
        """Take the code of a subclass; without one it has that of its base."""
        if error_code is not None:
            cls.error_code = error_code


class PlanningFailure(NavigationFailure, error_code=200):
    """No plan; codes of nav2_msgs/action/ComputePathToPose."""


class InvalidPlanner(PlanningFailure, error_code=201):
    """There is no planner of that name."""


class NoPose(PlanningFailure, error_code=202):
    """A pose cannot be brought into the map frame, or there is no map."""


class NoViapoints(PlanningFailure, error_code=209):
    """No poses to go through; a code of ComputePathThroughPoses alone, 309, less the offset of its codes."""


class StartOutsideMap(PlanningFailure, error_code=203):
    """The start is outside the costmap."""


class GoalOutsideMap(PlanningFailure, error_code=204):
    """The goal is outside the costmap."""


class StartOccupied(PlanningFailure, error_code=205):
    """The start is inside an obstacle."""


class GoalOccupied(PlanningFailure, error_code=206):
    """The goal, and everything within the tolerance around it, is inside an obstacle."""


class PlanningTimeout(PlanningFailure, error_code=207):
    """The search was given up."""


class NoValidPath(PlanningFailure, error_code=208):
    """Start and goal are free but not connected."""


class ControlFailure(NavigationFailure, error_code=101):
    """No command; codes of nav2_msgs/action/FollowPath."""


class InvalidPath(ControlFailure, error_code=103):
    """The path is empty or not a path."""


class NoValidControl(ControlFailure, error_code=106):
    """Every admissible command leads into a collision."""
