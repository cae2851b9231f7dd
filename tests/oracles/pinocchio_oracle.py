"""A converted robot held to pinocchio, which reads the same URDF text with its own reader and algebra."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import mujoco
import numpy as np
import pinocchio

from twin.convert.self_check import dof_indices, set_positions
from twin.geometry import matrix_from_quat_wxyz
from twin.models.description import Joint, RobotDescription
from twin.models.dynamics import SUFFIXES, degrees_of_freedom

SAMPLES = 3
FARTHEST = 3.0
"""Of joint ranges only this much is used [rad or m]: some give 1e10 for none."""


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Largest differences: poses in [m] and [-], the others relative to the largest element."""

    mass: float
    kinematics: float
    mass_matrix: float
    gravity: float
    bias: float
    """Coriolis, centrifugal and gravity forces at random speeds."""

    @property
    def worst(self) -> float:
        return max(asdict(self).values())


def compare(model: mujoco.MjModel, description: RobotDescription) -> Errors:
    """Compare at random joint positions and speeds; a free base is placed and thrown at random, too.

    Followers are joints of their own here, as pinocchio takes them.
    """
    free = bool(model.njnt) and model.body(description.root).jntnum[0] == 1
    root = [pinocchio.JointModelFreeFlyer()] if free else []
    oracle = pinocchio.buildModelFromXML(description.urdf, *root)
    total = sum(inertia.mass for inertia in oracle.inertias)
    rng = np.random.Generator(np.random.Philox(7))
    worst = np.zeros(4)
    for _ in range(SAMPLES):
        worst = np.maximum(worst, _sample(model, description, oracle, rng, free=free))
    kinematics, matrix, gravity, bias = worst.tolist()
    return Errors(
        mass=abs(float(model.body_mass.sum()) - total) / max(total, 1e-9),
        kinematics=kinematics,
        mass_matrix=matrix,
        gravity=gravity,
        bias=bias,
    )


def _sample(
    model: mujoco.MjModel, description: RobotDescription, oracle: Any, rng: np.random.Generator, *, free: bool
) -> tuple[float, float, float, float]:
    data, theirs = mujoco.MjData(model), oracle.createData()
    state = _State(oracle, model.nv)
    drawn = {name: _position(joint, rng) for name, joint in description.joints.items()}
    set_positions(model, data, description, drawn)
    data.qvel = rng.normal(size=model.nv)
    if free:
        data.qpos[:7] = _position(_FREE, rng)
        state.add(1, data.qpos[:7], list(range(6)), data.qvel, kind="floating")
    names = dict(zip(degrees_of_freedom(description), dof_indices(model, description), strict=True))
    for name, joint in description.joints.items():
        if joint.type != "fixed":
            ours = [names[f"{name}{suffix}"] for suffix in SUFFIXES.get(joint.type, ("",))]
            state.add(oracle.getJointId(name), drawn[name], ours, data.qvel, kind=joint.type)
    mujoco.mj_forward(model, data)
    pinocchio.framesForwardKinematics(oracle, theirs, state.q)
    kinematics = max(_pose_error(data, oracle, theirs, name) for name in description.links)
    if model.nv == 0:
        return kinematics, 0.0, 0.0, 0.0

    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    full -= np.diag(model.dof_armature)
    M = pinocchio.crba(oracle, theirs, state.q)
    M = np.triu(M) + np.triu(M, 1).T
    nle = pinocchio.nonLinearEffects(oracle, theirs, state.q, state.T @ data.qvel)
    gravity = pinocchio.computeGeneralizedGravity(oracle, theirs, state.q)
    bias = data.qfrc_bias.copy()
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    return (
        kinematics,
        _relative(full, state.T.T @ M @ state.T),
        _relative(data.qfrc_bias, state.T.T @ gravity),
        _relative(bias, state.T.T @ (nle + M @ state.drift)),
    )


class _State:
    """A state of the robot in pinocchio's coordinates.

    Its velocities of joints with several degrees of freedom are in the axes of the child, MuJoCo's slides in
    those of the parent: `v_pinocchio = T v_mujoco`, and accelerations differ by `drift` = dT/dt v_mujoco.
    """

    def __init__(self, oracle: Any, nv: int) -> None:
        self._oracle = oracle
        self.q = pinocchio.neutral(oracle)
        self.T = np.zeros((oracle.nv, nv))
        self.drift = np.zeros(oracle.nv)

    def add(self, joint: int, position: np.ndarray, ours: list[int], qvel: np.ndarray, *, kind: str) -> None:
        theirs = self._oracle.joints[joint]
        rows = slice(theirs.idx_v, theirs.idx_v + theirs.nv)
        q = self.q[theirs.idx_q : theirs.idx_q + theirs.nq]
        block = np.eye(theirs.nv)
        if kind == "floating":
            q[:3], q[3:] = position[:3], position[[4, 5, 6, 3]]
            block[:3, :3] = matrix_from_quat_wxyz(position[3:]).T
            self.drift[rows][:3] = -np.cross(qvel[ours[3:]], block[:3, :3] @ qvel[ours[:3]])
        elif kind == "planar":
            c, s = np.cos(position[2]), np.sin(position[2])
            q[:] = position[0], position[1], c, s
            block[:2, :2] = [[c, s], [-s, c]]
            vx, vy = block[:2, :2] @ qvel[ours[:2]]
            self.drift[rows][:2] = qvel[ours[2]] * np.array([vy, -vx])
        else:
            q[:] = (np.cos(position[0]), np.sin(position[0])) if theirs.nq == 2 else position
        self.T[rows, ours] = block


_FREE = Joint(name="", type="floating", parent="", child="", T_parent_joint=None)  # type: ignore[arg-type]


def _position(joint: Joint, rng: np.random.Generator) -> np.ndarray:
    if joint.type == "planar":
        return rng.uniform(-FARTHEST, FARTHEST, size=3)
    if joint.type == "floating":
        quat = rng.normal(size=4)
        return np.concatenate((rng.uniform(-1.0, 1.0, size=3), quat / np.linalg.norm(quat)))
    low = -FARTHEST if joint.limit.lower is None else joint.limit.lower
    high = FARTHEST if joint.limit.upper is None else joint.limit.upper
    return np.atleast_1d(rng.uniform(*np.clip([low, high], -FARTHEST, FARTHEST)))


def _pose_error(data: mujoco.MjData, oracle: Any, theirs: Any, link: str) -> float:
    placed = theirs.oMf[oracle.getFrameId(link, pinocchio.FrameType.BODY)]
    body = data.body("world_link" if link == "world" else link)
    return max(
        float(np.max(np.abs(body.xpos - placed.translation))),
        float(np.max(np.abs(body.xmat.reshape(3, 3) - placed.rotation))),
    )


def _relative(ours: np.ndarray, reference: np.ndarray) -> float:
    return float(np.max(np.abs(ours - reference)) / max(1e-6, float(np.max(np.abs(reference)))))
