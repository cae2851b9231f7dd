"""Does the written model behave as the description says? MuJoCo against plain numpy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from twin.convert.bodies import inertia_in_link
from twin.geometry import Pose3, matrix_from_quat_wxyz
from twin.models.description import Joint, Link, RobotDescription
from twin.models.dynamics import hinges_and_slides, mass_matrix_and_gravity
from twin.models.kinematics import joint_positions, link_poses

SAMPLES = 5
"""Random joint positions that are compared."""
FARTHEST = 100.0
"""Of ranges that mean none, only this much is used [rad or m]."""
TOLERANCE = 1e-9
"""Relative; for kinematics [m] and [-]."""


@dataclass(frozen=True, kw_only=True)
class SelfCheck:
    """The largest differences found."""

    mass: float
    """Of the total mass, relative."""
    kinematics: float
    """Of link positions [m] and of rotation matrices' elements."""
    mass_matrix: float
    """Relative to its largest element."""
    gravity: float
    """Of the joint forces that hold the robot, relative to the largest."""
    samples: int = SAMPLES
    tolerance: float = TOLERANCE

    @property
    def passed(self) -> bool:
        """Tell whether the model is the description's."""
        return max(self.mass, self.kinematics, self.mass_matrix, self.gravity) <= self.tolerance


def self_check(model: mujoco.MjModel, description: RobotDescription) -> SelfCheck:
    """Compare a model with its description at joint position zero and at random ones (fixed seed)."""
    description = replace(
        description, links={name: _repaired(link) for name, link in description.links.items()}
    )
    names, rng = hinges_and_slides(description), np.random.Generator(np.random.Philox(0))
    worst = np.zeros(3)
    for sample in range(SAMPLES):
        given = {name: _draw(description.joints[name], rng) if sample else 0.0 for name in names}
        positions = joint_positions(description, given)
        worst = np.maximum(worst, _differences(model, description, {n: positions[n] for n in names}))
    expected = sum(link.inertial.mass for link in description.links.values() if link.inertial)
    found = float(np.sum(model.body_mass))
    return SelfCheck(
        mass=abs(found - expected) / max(expected, 1e-12),
        kinematics=float(worst[0]),
        mass_matrix=float(worst[1]),
        gravity=float(worst[2]),
    )


def _differences(
    model: mujoco.MjModel, description: RobotDescription, positions: dict[str, float]
) -> tuple[float, float, float]:
    data = mujoco.MjData(model)
    for name, value in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    root = data.body(description.root)
    T_world_root = Pose3(root.xpos, root.xquat)
    kinematics = 0.0
    for name, pose in link_poses(description, positions).items():
        placed, body = T_world_root @ pose, data.body(name)
        rotation = matrix_from_quat_wxyz(placed.quat_wxyz) - body.xmat.reshape(3, 3)
        kinematics = max(kinematics, np.max(np.abs(body.xpos - placed.xyz)), np.max(np.abs(rotation)))
    if not positions:
        return kinematics, 0.0, 0.0
    dofs = [int(model.joint(name).dofadr[0]) for name in positions]
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    full -= np.diag(model.dof_armature)
    matrix, gravity = mass_matrix_and_gravity(description, positions)
    return (
        kinematics,
        _relative(full[np.ix_(dofs, dofs)] - matrix, matrix),
        _relative(data.qfrc_bias[dofs] - gravity, gravity),
    )


def _relative(difference: np.ndarray, reference: np.ndarray) -> float:
    return float(np.max(np.abs(difference)) / max(1.0e-3, np.max(np.abs(reference))))


def _draw(joint: Joint, rng: np.random.Generator) -> float:
    lower, upper = joint.limit.lower, joint.limit.upper
    low, high = -np.pi if lower is None else lower, np.pi if upper is None else upper
    return float(rng.uniform(*np.clip([low, high], -FARTHEST, FARTHEST)))


def _repaired(link: Link) -> Link:
    """Return the link with the inertia that the conversion gives it."""
    inertial = link.inertial
    if inertial is None:
        return link
    com = Pose3.from_xyz_rpy(inertial.T_link_com.xyz)
    return replace(link, inertial=replace(inertial, T_link_com=com, inertia=inertia_in_link(inertial)))
