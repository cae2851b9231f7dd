"""Does the written model behave as the description says? MuJoCo against plain numpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.description import Inertial, Joint, RobotDescription
from twin.models.dynamics import mass_matrix_and_gravity
from twin.models.kinematics import joint_positions, link_poses

SAMPLES = 5
"""Random joint positions that are compared."""
FARTHEST = 100.0
"""Of ranges that mean none, only this much is used [rad or m]."""
TOLERANCE = 1e-9
"""Relative; for kinematics [m] and [-]."""
QPOS_NAMES: Mapping[str, tuple[str, ...]] = {
    "fixed": (),
    "planar": ("_x", "_y", "_yaw"),
    "floating": ("_x", "_y", "_z", "_rotation"),
}
"""What is added to a joint's name for each MuJoCo joint that stands for it."""


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
    """Compare a model with its description at joint position zero and at random ones (fixed seed).

    Where the file's inertia is impossible, it is compared with the nearest possible one.
    """
    description = _as_settled(description)
    rng = np.random.Generator(np.random.Philox(0))
    worst = np.zeros(3)
    for sample in range(SAMPLES):
        drawn = {joint.name: _draw(joint, rng) for joint in description.joints.values()} if sample else {}
        positions = joint_positions(description, drawn)
        worst = np.maximum(worst, _differences(model, description, positions))
    expected = description.mass
    found = float(np.sum(model.body_mass))
    return SelfCheck(
        mass=abs(found - expected) / max(expected, 1e-12),
        kinematics=float(worst[0]),
        mass_matrix=float(worst[1]),
        gravity=float(worst[2]),
    )


def set_positions(
    model: mujoco.MjModel, data: mujoco.MjData, description: RobotDescription, positions: Mapping[str, Array]
) -> None:
    """Put a model's joints, planar and floating ones too, to `positions` as of `joint_positions`."""
    for name, joint in description.joints.items():
        names = QPOS_NAMES.get(joint.type, ("",))
        parts = np.split(positions[name], range(1, len(names))) if names else []
        for suffix, part in zip(names, parts, strict=True):
            start = model.joint(f"{name}{suffix}").qposadr[0]
            data.qpos[start : start + len(part)] = part


def dof_indices(model: mujoco.MjModel, description: RobotDescription) -> list[int]:
    """Return where in `qvel` the `degrees_of_freedom` of a description are."""
    indices: list[int] = []
    for name, joint in description.joints.items():
        for suffix in QPOS_NAMES.get(joint.type, ("",)):
            start = int(model.joint(f"{name}{suffix}").dofadr[0])
            indices += range(start, start + (3 if suffix == "_rotation" else 1))
    return indices


def _differences(
    model: mujoco.MjModel, description: RobotDescription, positions: Mapping[str, Array]
) -> tuple[float, float, float]:
    data = mujoco.MjData(model)
    set_positions(model, data, description, positions)
    mujoco.mj_forward(model, data)
    root = data.body(description.root)
    T_world_root = Pose3(root.xpos, root.xquat)
    kinematics = 0.0
    for name, pose in link_poses(description, positions).items():
        placed, body = T_world_root @ pose, data.body(name)
        rotation = matrix_from_quat_wxyz(placed.quat_wxyz) - body.xmat.reshape(3, 3)
        kinematics = max(kinematics, np.max(np.abs(body.xpos - placed.xyz)), np.max(np.abs(rotation)))
    dofs = dof_indices(model, description)
    if not dofs:
        return kinematics, 0.0, 0.0
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


def _draw(joint: Joint, rng: np.random.Generator) -> Array:
    if joint.type == "planar":
        return rng.uniform(-np.pi, np.pi, size=3)
    if joint.type == "floating":
        quat = rng.normal(size=4)
        return np.concatenate((rng.uniform(-1.0, 1.0, size=3), quat / np.linalg.norm(quat)))
    lower, upper = joint.limit.lower, joint.limit.upper
    low, high = -np.pi if lower is None else lower, np.pi if upper is None else upper
    return np.atleast_1d(rng.uniform(*np.clip([low, high], -FARTHEST, FARTHEST)))


def _as_settled(description: RobotDescription) -> RobotDescription:
    """Return the description with the inertias that had to be repaired as they are in the model."""
    settlement = description.settlement
    links = dict(description.links)
    for name, repair in settlement.repaired.items():
        body = settlement.bodies[name]
        com = Pose3(body.com, np.array([1.0, 0.0, 0.0, 0.0]))
        links[name] = replace(
            links[name], inertial=Inertial(T_link_com=com, mass=body.mass, inertia=body.inertia)
        )
        for part in repair.parts:
            links[part] = replace(links[part], inertial=None)
    return replace(description, links=links)
