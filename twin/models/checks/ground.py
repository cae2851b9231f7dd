"""How a wheeled robot stands: on its wheels, on something else, on how many points."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.wheels import Wheel, wheels_of
from twin.models.description import Link, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.shapes import Capsule, Sphere
from twin.models.solids import Shape, is_solid, lowest

CLEARANCE = 1e-3
"""Least height of the body over the ground [m]."""
LEVEL = 3e-3
"""Wheels and casters within this height of the ground carry [m]; casters are often raised by 1 mm."""
SLIPPERY = 0.1
CASTER_NAME = re.compile(r"caster|castor|ball|roller|skid", re.IGNORECASE)

Found = tuple[str, str, int, str, str]
"""Code, element, line, message and fix."""


@dataclass(frozen=True, kw_only=True)
class _Foot:
    """The lowest point of a part that is no wheel."""

    link: str
    line: int
    z: float
    """In the root frame [m]."""
    is_caster: bool


def ground(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield what keeps a wheeled robot from standing on its wheels; robots without wheels are left alone."""
    wheels = wheels_of(description)
    if not wheels:
        return
    floor = min(wheel.bottom for wheel in wheels)
    feet = _feet(description, wheels)
    for code, element, line, message, fix in (
        *_high_wheels(wheels, floor),
        *_low_feet(feet, floor),
        *_resting(feet, floor),
    ):
        yield finding(description, code, element, line, message, fix)
    supports = [wheel.link for wheel in wheels if wheel.bottom - floor <= LEVEL]
    supports += [foot.link for foot in feet if foot.is_caster and abs(foot.z - floor) <= LEVEL]
    if len(supports) < 3:
        line = description.links[description.root].line
        message = (
            f"of wheels and casters only {len(supports)} on the ground ({', '.join(supports)}); "
            "on fewer than 3 the robot tips over or drags its body"
        )
        fix = f"add a caster: a sphere that ends at z = {floor:.4g} m, with <mu1>0</mu1> for its link"
        yield finding(description, "few-supports", "robot", line, message, fix)


def _feet(description: RobotDescription, wheels: tuple[Wheel, ...]) -> list[_Foot]:
    poses = link_poses(description)
    turning = {wheel.link for wheel in wheels}
    solid = any(link.collisions for link in description.links.values())
    feet = []
    for link in description.links.values():
        shapes: tuple[Shape, ...] = link.collisions if solid else link.visuals
        pose = poses[link.name]
        heights = [(lowest(s.geometry, pose @ s.T_link_geometry), s) for s in shapes if is_solid(s)]
        if heights and link.name not in turning:
            z, shape = min(heights, key=lambda pair: pair[0])
            feet.append(_Foot(link=link.name, line=shape.line, z=z, is_caster=_is_caster(link, shape)))
    return feet


def _is_caster(link: Link, shape: Shape) -> bool:
    friction = link.surface.friction
    if friction is not None and friction <= SLIPPERY:
        return True
    return isinstance(shape.geometry, Sphere | Capsule) or bool(CASTER_NAME.search(link.name))


def _high_wheels(wheels: tuple[Wheel, ...], floor: float) -> Iterator[Found]:
    for wheel in wheels:
        above = wheel.bottom - floor
        if above > LEVEL:
            message = f"wheel '{wheel.link}' ends {1e3 * above:.3g} mm above the lowest wheel"
            fix = "put all wheels on one height: radius and <origin> z of the joint"
            yield "wheels-off-ground", f"link '{wheel.link}'", wheel.joint.line, message, fix


def _low_feet(feet: list[_Foot], floor: float) -> Iterator[Found]:
    for foot in feet:
        below = floor - foot.z
        if below > (LEVEL if foot.is_caster else CLEARANCE):
            message = (
                f"link '{foot.link}' reaches {1e3 * below:.3g} mm lower than the wheels "
                f"(z = {foot.z:.4g} m against {floor:.4g} m), which hang in the air"
            )
            fix = f"raise it by {1e3 * below:.3g} mm or more, or lower the wheels"
            yield "wheels-off-ground", f"link '{foot.link}'", foot.line, message, fix


def _resting(feet: list[_Foot], floor: float) -> Iterator[Found]:
    for foot in feet:
        if not foot.is_caster and abs(foot.z - floor) <= CLEARANCE:
            message = f"rests on the ground: it ends at z = {foot.z:.4g} m, the wheels at {floor:.4g} m"
            fix = "raise it by 10 mm or more, or lower the wheels' joints; a caster has <mu1>0</mu1>"
            yield "base-on-ground", f"link '{foot.link}'", foot.line, message, fix
