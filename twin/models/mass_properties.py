"""Masses and inertias as a physics engine can take them, and what had to change for that.

A rigid body moves alike however its mass is distributed over the links of which it is made. So a link whose
own inertia no body can have (CAD exports do that to small parts) is lumped into the link that carries it;
only if the whole is impossible too, the nearest possible inertia stands in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.description import Inertial, RobotDescription
from twin.models.kinematics import link_poses, rigid_groups

LEAST = 1e-15
"""MuJoCo takes a mass or moment up to this for zero [kg, kg m²]."""
ROUNDING = 1e-3
"""Slack of A + B >= C, relative to C: files print inertias with few digits."""
LEAST_GYRATION = 1e-5
"""Radius of gyration that a repaired body has at least [m]: a mere point cannot be integrated."""
STAND_IN = 1e-14
"""Mass and moments of massless links that carry others by joints [kg, kg m²]; MuJoCo needs some."""
_MOMENTS = np.array([[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]])
"""Principal moments of second moments of mass: A = b + c, and so on."""


@dataclass(frozen=True, kw_only=True)
class MassProperties:
    """Mass, centre and inertia of a body, in the axes of its link."""

    mass: float
    """[kg]"""
    com: Array
    """Centre of mass in the link frame [m], shape (3,)."""
    inertia: Array
    """About the centre of mass, in link axes [kg m²], shape (3, 3)."""


@dataclass(frozen=True, kw_only=True)
class Repair:
    """What the nearest possible inertia stands in for."""

    fault: str | None
    """Why no body has the inertia that the file gives; None for points, thin rods and errors of rounding."""
    change: float
    """Largest difference of the two matrices, relative to the largest moment."""
    parts: tuple[str, ...]
    """Links that are lumped into the repaired one."""


@dataclass(frozen=True, kw_only=True)
class Settlement:
    """The mass properties of a robot's links, such that each of them is possible."""

    bodies: Mapping[str, MassProperties]
    """By link; links without one weigh nothing."""
    lumped: Mapping[str, str]
    """Links whose mass properties went to another one, and to which."""
    repaired: Mapping[str, Repair]
    """Links with the nearest possible inertia."""
    massless_carriers: frozenset[str]
    """Links without mass that move and carry others by joints; a mass of `STAND_IN` makes no difference."""


def mass_properties_of(inertial: Inertial) -> MassProperties:
    """Return an `<inertial>` in the axes of its link."""
    R = matrix_from_quat_wxyz(inertial.T_link_com.quat_wxyz)
    return MassProperties(mass=inertial.mass, com=inertial.T_link_com.xyz, inertia=R @ inertial.inertia @ R.T)


def inertia_fault(inertia: Array, mass: float = 0.0) -> str | None:
    """Return why no rigid body has this inertia, shape (3, 3) [kg m²], or None if one can.

    With a `mass` [kg], errors of rounding pass, and so do points and rods without thickness.
    """
    moments = np.linalg.eigvalsh(inertia)
    shown = ", ".join(f"{value:.4g}" for value in moments)
    slack = 0.0 if mass == 0.0 else max(ROUNDING * moments[2], mass * LEAST_GYRATION**2)
    if moments[0] < -slack or (slack == 0.0 and moments[0] <= LEAST):
        return f"its principal moments {shown} kg m² are not all positive"
    if moments[0] + moments[1] < moments[2] - slack:
        return f"of its principal moments {shown} kg m² the largest exceeds the sum of the others"
    return None


def nearest_possible(body: MassProperties) -> MassProperties:
    """Return the body with the inertia that is nearest (Frobenius norm) to its own and that a body can have.

    An inertia is possible if the second moments of mass along its principal axes are not negative; the
    nearest such moments are a non-negative least-squares problem.
    """
    from scipy.optimize import nnls  # takes a third of a second to import, and few robots need it

    moments, axes = np.linalg.eigh(body.inertia)
    second, _ = nnls(_MOMENTS, moments)
    least = max(1e-9 * float(np.sum(second)), body.mass * LEAST_GYRATION**2)
    inertia = (axes * (_MOMENTS @ np.maximum(second, least))) @ axes.T
    return replace(body, inertia=inertia)


def settle(description: RobotDescription) -> Settlement:
    """Return mass properties that a physics engine can take: rigid bodies move as the file says.

    Only where a whole rigid body is impossible, its inertia changes; `repaired` tells.
    """
    declared = {
        name: mass_properties_of(link.inertial)
        for name, link in description.links.items()
        if link.inertial is not None
    }
    bodies, lumped, repaired = dict(declared), dict[str, str](), dict[str, Repair]()
    faulty = [name for name, body in declared.items() if _is_impossible(body)]
    poses, heads = (link_poses(description), rigid_groups(description)) if faulty else ({}, {})
    for head in dict.fromkeys(heads[name] for name in faulty):
        members = [name for name in declared if heads[name] == head]
        impossible = [name for name in members if _is_impossible(declared[name])]
        for chosen in (impossible, members):
            parts = [name for name in members if name == head or name in chosen]
            whole = _lump([(poses[head].inverse() @ poses[name], declared[name]) for name in parts])
            if not _is_impossible(whole):
                break
        bodies = {name: body for name, body in bodies.items() if name not in parts}
        lumped |= {name: head for name in parts if name != head}
        if whole.mass <= LEAST:
            continue
        bodies[head] = nearest_possible(whole) if _is_impossible(whole) else whole
        if bodies[head] is not whole:
            repaired[head] = Repair(
                fault=inertia_fault(whole.inertia, whole.mass),
                change=_change(whole.inertia, bodies[head].inertia),
                parts=tuple(name for name in parts if name != head),
            )
    carriers = frozenset(_carriers(description, bodies))
    trifle = MassProperties(mass=STAND_IN, com=np.zeros(3), inertia=STAND_IN * np.eye(3))
    bodies |= dict.fromkeys(carriers, trifle)
    return Settlement(bodies=bodies, lumped=lumped, repaired=repaired, massless_carriers=carriers)


def _carriers(description: RobotDescription, bodies: Mapping[str, MassProperties]) -> list[str]:
    """Return the heads of moving rigid bodies without mass that have mass further out."""
    heads = rigid_groups(description)
    heavy = {heads[name] for name in bodies}
    carrying: set[str] = set()
    for joint in reversed(description.outwards):
        if joint.type != "fixed" and (joint.child in heavy or joint.child in carrying):
            carrying.add(heads[joint.parent])
    return [name for name in description.links if name in carrying - heavy - {description.root}]


def describe_repair(head: str, repair: Repair, body: MassProperties) -> tuple[str, str]:
    """Return what is wrong with the rigid body that starts at link `head`, and the nearest possible."""
    among = f", with {', '.join(repair.parts)} fixed to it," if repair.parts else ""
    fault = repair.fault or "it is that of a point or a line, or rounded"
    nearest = f"the nearest possible is {inertia_as_urdf(body.inertia)}"
    if repair.fault:
        nearest += f", {repair.change:.1%} away"
    return f"link '{head}'{among} has an impossible inertia: {fault}", nearest


def inertia_as_urdf(inertia: Array) -> str:
    """Return an inertia, shape (3, 3) [kg m²], as an `<inertia>` element with four digits."""
    named = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    small = 1e-9 * float(np.max(np.abs(inertia)))
    values = {name: 0.0 if abs(inertia[place]) < small else inertia[place] for name, place in named.items()}
    return "<inertia " + " ".join(f"{name}='{value:.4g}'" for name, value in values.items()) + "/>"


def _is_impossible(body: MassProperties) -> bool:
    return inertia_fault(body.inertia) is not None or body.mass <= LEAST


def _lump(parts: list[tuple[Pose3, MassProperties]]) -> MassProperties:
    """Return bodies as one, each given with the pose of its link in the common frame."""
    return reduce(_add, (_seen_from(pose, body) for pose, body in parts))


def _seen_from(T_frame_link: Pose3, body: MassProperties) -> MassProperties:
    R = matrix_from_quat_wxyz(T_frame_link.quat_wxyz)
    return MassProperties(mass=body.mass, com=T_frame_link.xyz + R @ body.com, inertia=R @ body.inertia @ R.T)


def _add(a: MassProperties, b: MassProperties) -> MassProperties:
    mass = a.mass + b.mass
    share = 0.0 if mass == 0.0 else b.mass / mass
    d = b.com - a.com
    # Steiner, for both parts at once: the reduced mass at the distance of the two centres.
    parallel = a.mass * share * (float(d @ d) * np.eye(3) - np.outer(d, d))
    return MassProperties(mass=mass, com=a.com + share * d, inertia=a.inertia + b.inertia + parallel)


def _change(before: Array, after: Array) -> float:
    return float(np.max(np.abs(after - before)) / max(np.max(np.abs(before)), LEAST))
