"""Massless links that move: sound if what they carry gives every joint something to move."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.errors import ConversionError, Problem
from twin.geometry import Array
from twin.models.description import RobotDescription

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
