"""The conversion, step by step.

Massless links that move are sound if what they carry gives every joint something to move.
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from twin.convert.actuators import add_actuators, moved_inertia
from twin.convert.bodies import Base, add_bodies, free_name
from twin.convert.contact_roles import contact_guesses, roles_of
from twin.convert.contacts import add_excludes, exclude_overlaps, spawn_height
from twin.convert.conversion import Conversion
from twin.convert.geoms import GeomBuilder
from twin.convert.mujoco_log import without_warnings
from twin.convert.tyres import carry_load
from twin.errors import ConversionError, Problem
from twin.geometry import Array
from twin.models.description import WORLD, RobotDescription
from twin.models.mesh.meshes import mesh_faults

DEEPEST = 450
"""Links in a row; tinyxml2 reads 500 elements inside of each other."""
MOST_CACHED = 64 * 1024 * 1024
"""Bytes of compiled meshes that MuJoCo keeps for the next compilation; a very large one has more."""


def convert(
    description: RobotDescription, *, base: Base = "free", timestep: float = 0.002, visuals: bool = True
) -> Conversion:
    """Return a robot as a MuJoCo model, built body by body (MuJoCo's URDF reader fuses links, drops visuals).

    Args:
        description: The robot.
        base: `free`: the root link has a free joint (a root named `world`, or of a robot that is static, is
            fixed all the same). `fixed`: it is welded to the world. `kinematic`: it is a mocap body, moved by
            whoever sets its pose.
        timestep: Of the simulation it is meant for [s]; bounds how stiff contacts may be.
        visuals: False leaves out what is seen only, and does not read its meshes.

    Raises:
        ConversionError: A moving part has no mass, meshes cannot be read (all are named), or MuJoCo refuses
            the model.
    """
    faults = mesh_faults(description, visuals=visuals)
    if faults:
        raise ConversionError(faults)
    _refuse_deep(description)
    if (description.root == WORLD or description.static) and base == "free":
        base = "fixed"
    description = _without_world(description)
    roles = roles_of(description)
    # Some steps need to know how the bodies move; shapes, which take far longer, do not matter to that.
    bare = mujoco.MjSpec()
    add_bodies(bare, description, base=base, geoms=None, wheel_joints=roles.wheel_joints)
    moving = _compile(bare, description)
    refuse_singular(moving, description)
    spec = mujoco.MjSpec()
    spec.modelname = description.name
    spec.compiler.degree = False
    geoms = GeomBuilder(spec, roles, timestep=timestep, visuals=visuals)
    root_joint = add_bodies(spec, description, base=base, geoms=geoms, wheel_joints=roles.wheel_joints)
    add_excludes(spec, description)
    _add_extensions(spec, description)
    carry_load(spec, moving, roles)
    moved = moved_inertia(description, moving)
    servos = add_actuators(spec, description, moved, timestep=timestep)
    model = _compile(spec, description)
    return Conversion(
        description=description,
        spec=spec,
        spawn_height=spawn_height(model),
        root_joint=root_joint,
        guesses=(*contact_guesses(description, roles), *exclude_overlaps(spec, model, description), *servos),
        moved_inertia=moved,
    )


def _add_extensions(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Hold up the links that gravity does not pull, and add springs to joints, as `<gazebo>` says."""
    for link in description.links.values():
        if not link.surface.gravity:
            spec.body(link.name).gravcomp = 1.0
    for name, spring in description.springs.items():
        joint = spec.joint(name)
        joint.stiffness[0], joint.springref = spring.stiffness, spring.reference


def _compile(spec: mujoco.MjSpec, description: RobotDescription) -> mujoco.MjModel:
    try:
        mujoco.mj_setCacheCapacity(mujoco.mj_getCache(), MOST_CACHED)
        with without_warnings():  # refuse_singular names a singular mass matrix
            return spec.copy().compile()
    except ValueError as error:
        message = f"MuJoCo refuses robot '{description.name}': {' '.join(str(error).split())}"
        raise ConversionError(Problem(message, description.source, code="mujoco", element="robot")) from error


def _refuse_deep(description: RobotDescription) -> None:
    """Refuse a chain of links that is too long for the XML reader that MuJoCo uses."""
    depth = {description.root: 1}
    for joint in description.outwards:
        link = joint.child
        depth[link] = depth[joint.parent] + 1
        if depth[link] > DEEPEST:
            message = f"more than {DEEPEST} links hang on each other, down to '{link}'; MuJoCo reads no more"
            problem = Problem(message, description.source, code="mujoco", element=f"link '{link}'")
            raise ConversionError(problem)


def _without_world(description: RobotDescription) -> RobotDescription:
    """Return the robot with a link `world` renamed, as MuJoCo has a body of this name."""
    if WORLD not in description.links:
        return description
    names = {name: name for name in description.links}
    names[WORLD] = free_name(f"{WORLD}_link", description.links)
    return replace(
        description,
        root=names[description.root],
        links={names[key]: replace(link, name=names[key]) for key, link in description.links.items()},
        joints={
            key: replace(joint, parent=names[joint.parent], child=names[joint.child])
            for key, joint in description.joints.items()
        },
        sensors=tuple(replace(sensor, link=names[sensor.link]) for sensor in description.sensors),
        cameras=tuple(replace(camera, link=names[camera.link]) for camera in description.cameras),
    )


SINGULAR = 1e-9
"""Least eigenvalue of the mass matrix with ones on its diagonal, at which it still counts as regular."""


def refuse_singular(model: mujoco.MjModel, description: RobotDescription) -> None:
    """Refuse a robot in which massless links let two joints move the same mass in the same way.

    Raises:
        ConversionError: Some motion of the joints moves no mass: any force accelerates it without end.
    """
    if not description.settlement.massless_carriers:
        return
    rng = np.random.Generator(np.random.Philox(0))
    for positions in (model.qpos0, rng.uniform(-0.5, 0.5, size=model.nq)):
        least, motion = _least_motion(model, positions)
        if least <= SINGULAR:
            _refuse(model, description, motion)


def _least_motion(model: mujoco.MjModel, positions: Array) -> tuple[float, Array]:
    """Return the least eigenvalue of the scaled mass matrix and its joint motion, shape (nv,)."""
    data = mujoco.MjData(model)
    data.qpos[:] = positions
    mujoco.mj_normalizeQuat(model, data.qpos)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_crb(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    values, motions = np.linalg.eigh(matrix * np.outer(scale, scale))
    return float(values[0]), motions[:, 0]


def _refuse(model: mujoco.MjModel, description: RobotDescription, motion: Array) -> None:
    massless_carriers = description.settlement.massless_carriers
    moving = np.abs(motion) > 0.1
    bodies = {model.body(model.dof_bodyid[dof]).name for dof in np.flatnonzero(moving)}
    joints = [joint.name for joint in description.joints.values() if joint.child in bodies]
    links = sorted(massless_carriers & bodies) or sorted(massless_carriers)
    element, line = f"link '{links[0]}'", description.links[links[0]].line or None
    both = f"joints {', '.join(joints)} can turn together and move none"
    message = f"{element} has no mass, and {both}; give it an <inertial>"
    raise ConversionError(Problem(message, description.source, line, code="massless", element=element))
