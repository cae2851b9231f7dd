"""The conversion, step by step."""

from __future__ import annotations

import mujoco

from twin.convert.actuators import add_actuators
from twin.convert.bodies import Base, add_bodies
from twin.convert.contacts import add_excludes, spawn_height
from twin.convert.conversion import Conversion
from twin.convert.geoms import GeomBuilder
from twin.convert.ledger import describe_conversion
from twin.convert.roles import roles_of
from twin.errors import ConversionError, Problem
from twin.models.description import RobotDescription


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
    entries = add_actuators(spec, description, model, timestep=timestep)
    _compile(spec, description)
    return Conversion(
        description=description,
        spec=spec,
        spawn_height=spawn_height(model),
        root_joint=root_joint,
        ledger=(*describe_conversion(description, roles, base), *entries),
    )


def _compile(spec: mujoco.MjSpec, description: RobotDescription) -> mujoco.MjModel:
    """Compile a copy, in which a root link named like MuJoCo's world body has another name."""
    probe = spec.copy()
    root = probe.worldbody.first_body()
    if root.name == probe.worldbody.name:
        root.name = "world_link"
    try:
        return probe.compile()
    except ValueError as error:
        message = f"MuJoCo refuses robot '{description.name}': {' '.join(str(error).split())}"
        raise ConversionError(Problem(message, description.source)) from error
