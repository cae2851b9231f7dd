"""What the contacts of each link are for: rolling, gripping, or just being solid."""

from __future__ import annotations

from dataclasses import dataclass

from twin.models.description import RobotDescription


@dataclass(frozen=True, kw_only=True)
class Roles:
    """Links with contact parameters of their own."""

    wheels: frozenset[str]
    """Links that the drive turns."""
    gripping: frozenset[str]
    """Links that a commanded joint presses against things: they have a declared friction."""
    skid_steer: bool


def roles_of(description: RobotDescription) -> Roles:
    """Return the roles of a robot's links."""
    drive = description.drive
    turned = () if drive is None else (*drive.left_joints, *drive.right_joints)
    wheels = frozenset(description.joints[name].child for name in turned)
    gripping = frozenset(
        name
        for name, link in description.links.items()
        if (link.surface.friction or 0.0) > 0.0 and name not in wheels and _is_commanded(description, name)
    )
    skid_steer = drive is not None and drive.kind == "skid_steer"
    return Roles(wheels=wheels, gripping=gripping, skid_steer=skid_steer)


def _is_commanded(description: RobotDescription, link: str) -> bool:
    """Tell whether any joint between the root and `link` has a command, its own or its leader's."""
    joint_above = {joint.child: joint for joint in description.joints.values()}
    while link in joint_above:
        joint = joint_above[link]
        leader = joint
        while leader.mimic is not None:
            leader = description.joints[leader.mimic.joint]
        if leader.name in description.commands:
            return True
        link = joint.parent
    return False
