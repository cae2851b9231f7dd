"""Why navigation could not do what was asked, with the error codes of Nav2's actions.

These end an action with an error code: answers of the robot, not mistakes of the user (`twin.errors`).
"""

from __future__ import annotations


class NavigationFailure(Exception):
    """Base: `error_code` is the one of the nav2_msgs action that reports it."""

    error_code: int = 0


class PlanningFailure(NavigationFailure):
    """No plan; codes of nav2_msgs/action/ComputePathToPose."""

    error_code = 200


class InvalidPlanner(PlanningFailure):
    """There is no planner of that name."""

    error_code = 201


class NoPose(PlanningFailure):
    """A pose cannot be brought into the map frame, or there is no map."""

    error_code = 202


class NoViapoints(PlanningFailure):
    """No poses to go through; a code of ComputePathThroughPoses alone, 309, less the offset of its codes."""

    error_code = 209


class StartOutsideMap(PlanningFailure):
    """The start is outside the costmap."""

    error_code = 203


class GoalOutsideMap(PlanningFailure):
    """The goal is outside the costmap."""

    error_code = 204


class StartOccupied(PlanningFailure):
    """The start is inside an obstacle."""

    error_code = 205


class GoalOccupied(PlanningFailure):
    """The goal, and everything within the tolerance around it, is inside an obstacle."""

    error_code = 206


class PlanningTimeout(PlanningFailure):
    """The search was given up."""

    error_code = 207


class NoValidPath(PlanningFailure):
    """Start and goal are free but not connected."""

    error_code = 208


class ControlFailure(NavigationFailure):
    """No command; codes of nav2_msgs/action/FollowPath."""

    error_code = 101


class InvalidPath(ControlFailure):
    """The path is empty or not a path."""

    error_code = 103


class NoValidControl(ControlFailure):
    """Every admissible command leads into a collision."""

    error_code = 106
