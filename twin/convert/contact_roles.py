"""What the contacts of each link are for: rolling, gripping, or just being solid."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from twin.convert.conversion import Guess
from twin.models.checks.ground import CASTER_NAME, LEVEL
from twin.models.checks.wheels import Wheel, wheels_of
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses, rigid_groups
from twin.models.shapes import Mesh, Sphere
from twin.models.solids import lowest


@dataclass(frozen=True, kw_only=True)
class Roles:
    """Links with contact parameters of their own."""

    wheels: frozenset[str]
    """Links that a motor turns as wheels."""
    wheel_joints: frozenset[str]
    """The joints above them."""
    gripping: frozenset[str]
    """Links that a commanded joint presses against things: they have a declared friction."""
    casters: frozenset[str]
    """Balls and casters without joints on which a driven robot slides; the file gives them no friction."""
    skid_steer: bool


def roles_of(description: RobotDescription) -> Roles:
    """Return the roles of a robot's links."""
    drive = description.drive
    driven = commanded_wheels(description)
    wheels = frozenset(wheel.link for wheel in driven)
    gripping = frozenset(
        name
        for name, link in description.links.items()
        if (link.surface.friction or 0.0) > 0.0 and name not in wheels and _is_commanded(description, name)
    )
    return Roles(
        wheels=wheels,
        wheel_joints=frozenset(wheel.joint.name for wheel in driven),
        gripping=gripping,
        casters=_casters(description, wheels) if driven else frozenset(),
        # without a drive plugin, more than two wheels cannot all roll round a curve
        skid_steer=len(driven) > 2 if drive is None else drive.kind == "skid_steer",
    )


def commanded_wheels(description: RobotDescription) -> tuple[Wheel, ...]:
    """Return the wheels of the drive, left ones first, then others with a velocity command."""
    drive = description.drive
    order = () if drive is None else (*drive.left_joints, *drive.right_joints)
    known = {wheel.joint.name: wheel for wheel in wheels_of(description)}
    by_velocity = {name for name, spec in description.commands.items() if spec.interface == "velocity"}
    others = [wheel for name, wheel in known.items() if name not in order and name in by_velocity]
    return (*(known[name] for name in order), *others)


def _casters(description: RobotDescription, wheels: frozenset[str]) -> frozenset[str]:
    heads, poses = rigid_groups(description), link_poses(description)
    bottoms = {
        name: min(lowest(c.geometry, poses[name] @ c.T_link_geometry) for c in link.collisions)
        for name, link in description.links.items()
        if link.collisions and not any(isinstance(c.geometry, Mesh) for c in link.collisions)
    }
    floor = min((bottoms[name] for name in wheels if name in bottoms), default=math.inf)
    return frozenset(
        name
        for name, bottom in bottoms.items()
        if heads[name] == heads[description.root]
        and description.links[name].surface.friction is None
        and bottom < floor + LEVEL
        and (
            CASTER_NAME.search(name)
            or all(isinstance(c.geometry, Sphere) for c in description.links[name].collisions)
        )
    )


def _is_commanded(description: RobotDescription, link: str) -> bool:
    """Tell whether any joint between the root and `link` has a command, its own or its leader's."""
    for joint in description.above(link):
        while joint.mimic is not None:
            joint = description.joints[joint.mimic.joint]
        if joint.name in description.commands:
            return True
    return False


def contact_guesses(description: RobotDescription, roles: Roles) -> Iterator[Guess]:
    """Yield what was chosen for the contacts of links, as the robot file does not say it, in file order."""
    for link in description.links.values():
        element = f"link '{link.name}'"
        if link.name in roles.wheels:
            yield Guess(element=f"contact of {element}", note="carries the robot without sinking in")
        if link.surface.friction is None and link.name in roles.casters:
            yield Guess(element=f"friction of {element}", note="none: it slides where a caster would roll")
        elif link.surface.friction is None and link.collisions:
            note = "the larger of 1 and that of what it touches"
            yield Guess(element=f"friction of {element}", note=note)
        if link.name in roles.gripping:
            note = "stiff: a commanded joint presses it against things"
            yield Guess(element=f"contact of {element}", note=note)
