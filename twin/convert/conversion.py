"""What a conversion yields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco

from twin.models.description import RobotDescription

Outcome = Literal["kept", "translated", "guessed", "dropped"]
"""kept: means the same in MuJoCo. translated: other words, same meaning. guessed: the file does not say, so a
default was chosen. dropped: has no effect in the simulation."""


@dataclass(frozen=True, kw_only=True)
class LedgerEntry:
    """What became of one element of the robot file."""

    element: str
    """Such as `joint 'lift_joint'`."""
    outcome: Outcome
    note: str
    """What it is in MuJoCo, or why not."""


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """A robot as a MuJoCo model.

    Every link is a body, every moving joint a joint of its name. A drive's wheels and the joints commanded by
    `<ros2_control>` have an actuator named after the joint: velocity [rad/s] for wheels, else as the command
    interface says (position [rad or m], velocity, effort). Position actuators are stiff and jump to a new
    command as fast as their effort allows: feed them a trajectory that keeps to the joint's velocity limit.
    Visuals are in geom group 2, collision shapes in group 3.
    """

    description: RobotDescription
    """As given; only a root link `world` is called `world_link`, as MuJoCo has a body `world` of its own."""
    spec: mujoco.MjSpec
    """The robot alone, without floor, light or options; copy it before a change."""
    spawn_height: float
    """Height of the root link at which the lowest collision point, all joints at zero, touches z = 0 [m]."""
    root_joint: str | None
    """Name of the free joint of the root link; None for a fixed or kinematic base."""
    ledger: tuple[LedgerEntry, ...]
