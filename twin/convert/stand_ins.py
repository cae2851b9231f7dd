"""Massless links that move: sound if what they carry gives every joint something to move."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.errors import ConversionError, Problem
from twin.models.description import RobotDescription

SINGULAR = 1e-9
"""Least eigenvalue of the mass matrix with ones on its diagonal, at which it still counts as regular."""


def refuse_singular(model: mujoco.MjModel, description: RobotDescription) -> None:
    """Refuse a robot in which massless links let two joints move the same mass in the same way.

    Raises:
        ConversionError: Some motion of the joints moves no mass: any force accelerates it without end.
    """
    stand_ins = description.settlement.stand_ins
    if not stand_ins:
        return
    data = mujoco.MjData(model)
    rng = np.random.Generator(np.random.Philox(0))
    data.qpos[:] = rng.uniform(-0.5, 0.5, size=model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    least, motions = np.linalg.eigh(matrix * np.outer(scale, scale))
    if least[0] > SINGULAR:
        return
    moving = np.abs(motions[:, 0]) > 0.1
    bodies = {model.body(model.dof_bodyid[dof]).name for dof in np.flatnonzero(moving)}
    joints = [joint.name for joint in description.joints.values() if joint.child in bodies]
    links = sorted(stand_ins & bodies) or sorted(stand_ins)
    raise ConversionError(
        Problem(
            f"link '{links[0]}' has no mass, and joints {', '.join(joints)} can turn together and move none; "
            "give it an <inertial>",
            description.source,
            description.links[links[0]].line or None,
            code="massless",
            element=f"link '{links[0]}'",
        )
    )
