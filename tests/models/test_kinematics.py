"""Forward kinematics and Jacobians by frame name, as KDL trees were used for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.errors import ModelError
from twin.geometry import Pose3, matrix_from_quat_wxyz
from twin.models import load
from twin.models.description import Joint, RobotDescription
from twin.models.dynamics import degrees_of_freedom
from twin.models.kinematics import joint_positions, planar_axes
from twin.models.loader import parse_urdf

TEXT = """<robot name='r'>
  <link name='base'/><link name='cart'/><link name='arm'/><link name='ball'/><link name='tool'/>
  <joint name='drive' type='planar'><origin xyz='0 0 1' rpy='0.1 0.2 0.3'/>
    <parent link='base'/><child link='cart'/><axis xyz='0 1 1'/></joint>
  <joint name='lift' type='prismatic'><origin xyz='0 0.5 0' rpy='0.4 0 0'/>
    <parent link='cart'/><child link='arm'/><axis xyz='1 0 1'/><limit lower='-1' upper='1'/></joint>
  <joint name='loose' type='floating'><parent link='arm'/><child link='ball'/></joint>
  <joint name='turn' type='continuous'><origin xyz='1 0 0'/>
    <parent link='ball'/><child link='tool'/><axis xyz='0 3 4'/></joint>
</robot>"""
STATE = {
    "drive": np.array([0.3, -0.2, 0.7]),
    "lift": np.array([0.4]),
    "loose": np.array([0.1, 0.2, 0.3, 0.5, 0.5, -0.5, 0.5]),
    "turn": np.array([-0.6]),
}


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return parse_urdf(TEXT, Path("r.urdf"))


def moved(state: dict[str, Any], name: str, step: float) -> dict[str, np.ndarray]:
    """Return the state after a small step along one degree of freedom."""
    joint, _, part = name.partition("_")
    position = state[joint].copy()
    if part.startswith("w"):
        half = np.zeros(3)
        half["xyz".index(part[1])] = step / 2.0
        turned = Pose3(np.zeros(3), position[3:]) @ Pose3(np.zeros(3), np.array([1.0, *half]))
        position[3:] = turned.quat_wxyz / np.linalg.norm(turned.quat_wxyz)
    else:
        position[{"": 0, "x": 0, "y": 1, "z": 2, "yaw": 2}[part]] += step
    return {**state, joint: position}


def test_jacobian_is_the_derivative_of_the_pose(robot: RobotDescription) -> None:
    names = degrees_of_freedom(robot)
    assert names == (
        "drive_x", "drive_y", "drive_yaw", "lift",
        "loose_x", "loose_y", "loose_z", "loose_wx", "loose_wy", "loose_wz", "turn",
    )  # fmt: skip
    step = 1e-6
    J = robot.jacobian("tool", STATE)
    for column, name in enumerate(names):
        before, after = (robot.pose("tool", moved(STATE, name, sign * step)) for sign in (-1, 1))
        np.testing.assert_allclose(J[:3, column], (after.xyz - before.xyz) / (2 * step), atol=1e-8)
        spin = matrix_from_quat_wxyz(after.quat_wxyz) @ matrix_from_quat_wxyz(before.quat_wxyz).T
        skew = (spin - spin.T) / 2.0
        rate = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (2 * step)
        np.testing.assert_allclose(J[3:, column], rate, atol=1e-8)


def test_a_planar_joint_moves_in_the_plane_of_its_axis(robot: RobotDescription) -> None:
    normal = matrix_from_quat_wxyz(robot.joints["drive"].T_parent_joint.quat_wxyz) @ [0, 0.5**0.5, 0.5**0.5]
    start, end = (robot.pose("cart", {"drive": position}) for position in ((0, 0, 0), (3, 4, 1)))
    assert np.linalg.norm(end.xyz - start.xyz) == pytest.approx(5.0)
    assert (end.xyz - start.xyz) @ normal == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, -0.8), (0.0, 0.0, -1.0)])
def test_axes_of_a_plane_are_a_right_handed_frame(normal: tuple[float, float, float]) -> None:
    joint = Joint(
        name="j", type="planar", parent="a", child="b", T_parent_joint=Pose3.from_xyz_rpy(), axis=normal
    )
    R = np.stack(planar_axes(joint), axis=1)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert R[:, 2] == pytest.approx(normal)
    if normal == (0.0, 0.0, 1.0):
        np.testing.assert_array_equal(R, np.eye(3))


def test_poses_between_any_two_frames() -> None:
    bot = load("warehouse_bot")
    positions = {"lift_joint": 0.5, "wrist_yaw_joint": 1.0}
    direct = bot.pose("grasp_frame", positions, reference="lidar_link")
    detour = bot.pose("lidar_link", positions).inverse() @ bot.pose("grasp_frame", positions)
    np.testing.assert_allclose(direct.xyz, detour.xyz)
    assert bot.pose("grasp_frame", positions).xyz[2] - bot.pose("grasp_frame").xyz[2] == pytest.approx(0.5)


def test_wrong_names_are_named_all_at_once() -> None:
    bot = load("warehouse_bot")
    with pytest.raises(ModelError) as caught:
        bot.pose("grasp_fram", {"lift": 1.0})
    assert len(caught.value.problems) == 2
    assert "has no link 'grasp_fram'; did you mean 'grasp_frame'?" in str(caught.value)
    assert "has no joint 'lift'; did you mean 'lift_joint'?" in str(caught.value)


@pytest.mark.parametrize("name", ["warehouse_bot", "r2d2", "test_robot"])
def test_jacobian_equals_pinocchio(name: str) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    bot = load(name)
    oracle = pinocchio.buildModelFromXML(bot.urdf)
    data = oracle.createData()
    names = degrees_of_freedom(bot)
    every = joint_positions(bot, {name: 0.2 + 0.01 * index for index, name in enumerate(names)})
    q, columns = pinocchio.neutral(oracle), []
    for name in names:
        joint, value = oracle.joints[oracle.getJointId(name)], every[name][0]
        pair = (np.cos(value), np.sin(value))
        q[joint.idx_q : joint.idx_q + joint.nq] = pair if joint.nq == 2 else value
        columns.append(joint.idx_v)
    for link in bot.links:
        frame = oracle.getFrameId(link, pinocchio.FrameType.BODY)
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        expected = pinocchio.computeFrameJacobian(oracle, data, q, frame, axes)[:, columns]
        np.testing.assert_allclose(bot.jacobian(link, every), expected, atol=1e-9)
