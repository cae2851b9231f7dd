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
    floor = min(_bottom(wheel) for wheel in wheels)
    feet = _feet(description, wheels)
    yield from _high_wheels(description, wheels, floor, feet)
    yield from _resting(description, floor, feet)
    yield from _few_supports(description, wheels, floor, feet)


def _bottom(wheel: Wheel) -> float:
    return float(wheel.centre[2]) - wheel.radius


def _feet(description: RobotDescription, wheels: tuple[Wheel, ...]) -> list[_Foot]:
    poses = link_poses(description)
    turning = {wheel.link for wheel in wheels}
    solid = any(link.collisions for link in description.links.values())
    feet = []
    for link in description.links.values():
        shapes: tuple[Shape, ...] = link.collisions if solid else link.visuals
        known = [shape for shape in shapes if is_solid(shape)]
        if not known or link.name in turning:
            continue
        heights = [
            (lowest(shape.geometry, poses[link.name] @ shape.T_link_geometry), shape) for shape in known
        ]
        z, shape = min(heights, key=lambda pair: pair[0])
        feet.append(_Foot(link=link.name, line=shape.line, z=z, is_caster=_is_caster(link, shape)))
    return feet


def _is_caster(link: Link, shape: Shape) -> bool:
    friction = link.surface.friction
    if friction is not None and friction <= SLIPPERY:
        return True
    return isinstance(shape.geometry, Sphere | Capsule) or bool(CASTER_NAME.search(link.name))


def _high_wheels(
    description: RobotDescription, wheels: tuple[Wheel, ...], floor: float, feet: list[_Foot]
) -> Iterator[Diagnostic]:
    for wheel in wheels:
        above = _bottom(wheel) - floor
        if above > LEVEL:
            yield finding(
                description,
                "wheels-off-ground",
                f"link '{wheel.link}'",
                wheel.joint.line,
                message=f"wheel '{wheel.link}' ends {1e3 * above:.3g} mm above the lowest wheel",
                fix="put all wheels on one height: radius and <origin> z of the joint",
            )
    for foot in feet:
        below = floor - foot.z
        if below > (LEVEL if foot.is_caster else CLEARANCE):
            yield finding(
                description,
                "wheels-off-ground",
                f"link '{foot.link}'",
                foot.line,
                message=f"link '{foot.link}' reaches {1e3 * below:.3g} mm lower than the wheels "
                f"(z = {foot.z:.4g} m against {floor:.4g} m), which hang in the air",
                fix=f"raise it by {1e3 * below:.3g} mm or more, or lower the wheels",
            )


def _resting(description: RobotDescription, floor: float, feet: list[_Foot]) -> Iterator[Diagnostic]:
    for foot in feet:
        if not foot.is_caster and abs(foot.z - floor) <= CLEARANCE:
            yield finding(
                description,
                "base-on-ground",
                f"link '{foot.link}'",
                foot.line,
                message=f"rests on the ground: it ends at z = {foot.z:.4g} m, the wheels at {floor:.4g} m",
                fix="raise it by 10 mm or more, or lower the wheels' joints; a caster has <mu1>0</mu1>",
            )


def _few_supports(
    description: RobotDescription, wheels: tuple[Wheel, ...], floor: float, feet: list[_Foot]
) -> Iterator[Diagnostic]:
    supports = [wheel.link for wheel in wheels if _bottom(wheel) - floor <= LEVEL]
    supports += [foot.link for foot in feet if foot.is_caster and abs(foot.z - floor) <= LEVEL]
    if len(supports) < 3:
        yield finding(
            description,
            "few-supports",
            "robot",
            description.links[description.root].line,
            message=f"of wheels and casters only {len(supports)} on the ground ({', '.join(supports)}); "
            "on fewer than 3 the robot tips over or drags its body",
            fix=f"add a caster: a sphere that ends at z = {floor:.4g} m, with <mu1>0</mu1> for its link",
        )
