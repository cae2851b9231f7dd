"""`twin.load_robot`: kinematics and dynamics against MuJoCo, yourdfpy and pinocchio."""

from __future__ import annotations

import sys

import mujoco
import numpy as np
import pytest

import twin
from twin.geometry import matrix_from_quat_wxyz

ROBOTS = ("diff_bot", "warehouse_bot", "r2d2")


def positions(robot: twin.Robot, seed: int) -> dict[str, float]:
    """Return random positions within limits of the joints that move and mimic nobody."""
    rng = np.random.Generator(np.random.Philox(seed))
    return {
        name: float(rng.uniform(joint.limit.lower or -1.0, joint.limit.upper or 1.0))
        for name, joint in robot.joints.items()
        if joint.type in ("revolute", "continuous", "prismatic") and joint.mimic is None
    }


def all_positions(robot: twin.Robot, given: dict[str, float]) -> dict[str, float]:
    mimics = {name: joint.mimic for name, joint in robot.joints.items() if joint.mimic is not None}
    return given | {name: m.multiplier * given[m.joint] + m.offset for name, m in mimics.items()}


@pytest.mark.parametrize("name", ROBOTS)
def test_robot_against_mujoco(name: str) -> None:
    robot = twin.load_robot(name)
    model = robot.spec(base="fixed").compile()
    given = positions(robot, 3)
    data = mujoco.MjData(model)
    for joint, value in all_positions(robot, given).items():
        data.qpos[model.joint(joint).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    dofs = [int(model.joint(velocity).dofadr[0]) for velocity in robot.velocities]
    root = data.body(robot.root)
    to_root = root.xmat.reshape(3, 3).T
    for link, pose in robot.poses(given).items():
        body = data.body(link)
        np.testing.assert_allclose(to_root @ (body.xpos - root.xpos), pose.xyz, atol=1e-9)
        rotation = to_root @ body.xmat.reshape(3, 3)
        np.testing.assert_allclose(rotation, matrix_from_quat_wxyz(pose.quat_wxyz), atol=1e-9)
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBody(model, data, linear, angular, body.id)
        expected = np.vstack((to_root @ linear, to_root @ angular))[:, dofs]
        np.testing.assert_allclose(robot.jacobian(link, given), expected, atol=1e-9)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    full -= np.diag(model.dof_armature)
    np.testing.assert_allclose(robot.mass_matrix(given), full[np.ix_(dofs, dofs)], atol=1e-9)
    np.testing.assert_allclose(robot.gravity_forces(given), data.qfrc_bias[dofs], atol=1e-8)


@pytest.mark.parametrize("name", ROBOTS)
def test_robot_against_pinocchio(name: str) -> None:
    pinocchio = pytest.importorskip("pinocchio", reason="pinocchio is not installed (pip install pin)")
    robot = twin.load_robot(name)
    given = positions(robot, 5)
    model = pinocchio.buildModelFromXML(robot.description.urdf)
    data, q = model.createData(), pinocchio.neutral(model)
    rows = {}
    for joint, value in all_positions(robot, given).items():
        entry = model.joints[model.getJointId(joint)]
        rows[joint] = entry.idx_v
        turns = entry.nq == 2  # a continuous joint is a point of the unit circle
        q[entry.idx_q : entry.idx_q + entry.nq] = [np.cos(value), np.sin(value)] if turns else [value]
    dofs = [rows[velocity] for velocity in robot.velocities]
    pinocchio.crba(model, data, q)
    full = np.triu(data.M) + np.triu(data.M, 1).T
    np.testing.assert_allclose(robot.mass_matrix(given), full[np.ix_(dofs, dofs)], atol=1e-9)
    pinocchio.framesForwardKinematics(model, data, q)
    for link, pose in robot.poses(given).items():
        frame = model.getFrameId(link)
        np.testing.assert_allclose(data.oMf[frame].translation, pose.xyz, atol=1e-9)
        aligned = pinocchio.computeFrameJacobian(
            model, data, q, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        np.testing.assert_allclose(robot.jacobian(link, given), aligned[:, dofs], atol=1e-9)


def test_robot_as_yourdfpy() -> None:
    pytest.importorskip("yourdfpy")
    robot = twin.load_robot("warehouse_bot")
    given = positions(robot, 7)
    urdf = robot.urdf()
    urdf.update_cfg(given)
    for link, pose in robot.poses(given).items():
        np.testing.assert_allclose(urdf.get_transform(link)[:3, 3], pose.xyz, atol=1e-9)
    assert len(urdf.scene.geometry) > 10


def test_what_is_missing_for_yourdfpy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yourdfpy", None)
    with pytest.raises(twin.TwinError, match=r"pip install yourdfpy"):
        twin.load_robot("diff_bot").urdf()


def test_xacro_arguments_and_wrong_names() -> None:
    with pytest.raises(twin.TwinError, match="did you mean 'diff_bot'"):
        twin.load_robot("dif_bot")
    robot = twin.load_robot("diff_bot")
    with pytest.raises(twin.TwinError, match="has no joint 'left'"):
        robot.poses({"left": 1.0})
    with pytest.raises(twin.TwinError, match="has no link 'hand'"):
        robot.jacobian("hand")
