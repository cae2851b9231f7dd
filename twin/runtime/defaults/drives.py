"""The drive of a robot in a scenario: that of its file, one guessed by its wheels, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from twin.errors import Problem, ScenarioError
from twin.models.checks.drive import VALID_DRIVES, guess_drive, lack_of_drive
from twin.models.description import RobotDescription
from twin.scenario.missions import Behaviors, Idle, Mission, R2D2StatePublisher, UserMission
from twin.scenario.robots import RobotConfig


def with_drive(
    description: RobotDescription, robot: RobotConfig, missions: Sequence[Mission]
) -> RobotDescription:
    """Return a robot with the drive that its wheels suggest if its file has none.

    Raises:
        ScenarioError: It has none at all, and is to move.
    """
    if description.drive is None and robot.base == "free" and not description.static:
        description = replace(description, drive=guess_drive(description))
    task = next(filter(None, (_task(robot, mission) for mission in missions)), "")
    if description.drive is None and task:
        why, line = lack_of_drive(description)
        message = f"robot '{robot.id}' has no drive, which {task} needs: {why}; {VALID_DRIVES}"
        raise ScenarioError(Problem(message, description.source, line or None))
    return description


def _task(robot: RobotConfig, mission: Mission) -> str:
    """Return what moves a robot, in words; empty: nothing does."""
    if robot.navigation is not None:
        return "its navigation"
    if isinstance(mission, Idle | R2D2StatePublisher | UserMission) or mission.robot != robot.id:
        return ""
    still = isinstance(mission, Behaviors) and all(step.kind == "wait" for step in mission.steps)
    return "" if still else f"the mission {mission.type}"
