"""The conversion, step by step."""

from __future__ import annotations

from dataclasses import replace

import mujoco

from twin.convert.actuators import add_actuators
from twin.convert.bodies import Base, add_bodies
from twin.convert.contacts import add_excludes, spawn_height
from twin.convert.conversion import Conversion, LedgerEntry
from twin.convert.geoms import GeomBuilder
from twin.convert.ledger import describe_conversion
from twin.convert.roles import roles_of
from twin.convert.tyres import carry_load
from twin.errors import ConversionError, Problem
from twin.models.description import RobotDescription

WORLD = "world"
"""A root link of this name means a robot that is bolted down."""


def convert(description: RobotDescription, *, base: Base = "free", timestep: float = 0.002) -> Conversion:
    """Return a robot as a MuJoCo model, built body by body (MuJoCo's URDF reader fuses links, drops visuals).

    Args:
        description: The robot.
        base: `free`: the root link has a free joint (a root named `world` is fixed all the same). `fixed`: it
            is welded to the world. `kinematic`: it is a mocap body, moved by whoever sets its pose.
        timestep: Of the simulation it is meant for [s]; bounds how stiff contacts may be.

    Raises:
        ConversionError: A moving part has no mass, a mesh has a format that MuJoCo cannot read, or MuJoCo
            refuses the model.
    """
    description, renamed = _without_world(description)
    if renamed and base == "free":
        base = "fixed"
    roles = roles_of(description)
    spec = mujoco.MjSpec()
    spec.modelname = description.name
    spec.compiler.degree = False
    drive = description.drive
    wheel_joints = frozenset(() if drive is None else (*drive.left_joints, *drive.right_joints))
    root_joint = add_bodies(
        spec,
        description,
        base=base,
        geoms=GeomBuilder(spec, roles, timestep=timestep),
        wheel_joints=wheel_joints,
    )
    add_excludes(spec, description)
    model = _compile(spec, description)
    carry_load(spec, model, roles)
    entries = add_actuators(spec, description, model, timestep=timestep)
    _compile(spec, description)
    return Conversion(
        description=description,
        spec=spec,
        spawn_height=spawn_height(model),
        root_joint=root_joint,
        ledger=(*renamed, *describe_conversion(description, roles, base), *entries),
    )


def _compile(spec: mujoco.MjSpec, description: RobotDescription) -> mujoco.MjModel:
    try:
        return spec.copy().compile()
    except ValueError as error:
        message = f"MuJoCo refuses robot '{description.name}': {' '.join(str(error).split())}"
        raise ConversionError(Problem(message, description.source, code="mujoco", element="robot")) from error


def _without_world(description: RobotDescription) -> tuple[RobotDescription, list[LedgerEntry]]:
    """Return the robot with a root link `world` renamed, and what to note about it."""
    if description.root != WORLD:
        return description, []
    name = f"{WORLD}_link"
    links = {(name if key == WORLD else key): link for key, link in description.links.items()}
    links[name] = replace(links[name], name=name)
    joints = {
        key: replace(joint, parent=name) if joint.parent == WORLD else joint
        for key, joint in description.joints.items()
    }
    sensors = tuple(replace(s, link=name) if s.link == WORLD else s for s in description.sensors)
    note = f"body '{name}'; MuJoCo has a body '{WORLD}' of its own"
    entry = LedgerEntry(element=f"link '{WORLD}'", outcome="translated", note=note)
    return replace(description, root=name, links=links, joints=joints, sensors=sensors), [entry]
