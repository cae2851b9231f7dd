"""What a conversion yields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco

from twin.models.description import RobotDescription


@dataclass(frozen=True, kw_only=True)
class Guess:
    """What was chosen because the robot file does not say it."""

    element: str
    """Such as `friction of link 'base'`."""
    note: str
    """What was chosen."""


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """A robot as a MuJoCo model.

    Every link is a body, every moving joint a joint of its name. A drive's wheels and the joints commanded by
    `<ros2_control>` have an actuator named after the joint: velocity [rad/s] for wheels, else as the command
    interface says (position [rad or m], velocity, effort). Position actuators are stiff and jump to a new
    command as fast as their effort allows; `twin.sim` lets them keep to the joint's velocity limit.
    Visuals are in geom group 2, collision shapes in group 3.
    """

    description: RobotDescription
    """As given; only a link `world` has another name, as MuJoCo has a body `world` of its own."""
    spec: mujoco.MjSpec
    """The robot alone, without floor, light or options; copy it before a change."""
    spawn_height: float
    """Height of the root link at which the lowest collision point, all joints at zero, touches z = 0 [m]."""
    root_joint: str | None
    """Name of the free joint of the root link; None for a fixed or kinematic base."""
    moved_inertia: Mapping[str, float] = field(default_factory=dict)
    """Of each commanded joint with all that it moves [kg or kg m²]."""
    guesses: tuple[Guess, ...]
    """Of everything else, `twin.convert.ledger.tags` tells what became of it."""
