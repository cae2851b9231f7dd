import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from twin.geometry import (
    Pose2,
    Pose3,
    matrix_from_quat_wxyz,
    multiply_wxyz,
    quat_wxyz_from_rpy,
    rotate_wxyz,
    rpy_from_quat_wxyz,
    wrap_angle,
    wrap_angles,
    wxyz_from_xyzw,
    xyzw_from_wxyz,
    yaw_from_quat_wxyz,
)

angle = st.floats(-10.0, 10.0)
length = st.floats(-100.0, 100.0)
poses2 = st.builds(Pose2, length, length, st.floats(-math.pi, math.pi))
poses3 = st.builds(
    Pose3.from_xyz_rpy, st.tuples(length, length, length), st.tuples(angle, st.floats(-1.5, 1.5), angle)
)


@given(angle, angle, angle)
def test_rpy_is_urdfs_fixed_axis_convention(roll: float, pitch: float, yaw: float) -> None:
    ours = matrix_from_quat_wxyz(quat_wxyz_from_rpy(roll, pitch, yaw))
    np.testing.assert_allclose(ours, Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix(), atol=1e-12)


@given(poses3, poses3)
def test_quaternion_products_and_rotations_agree_with_scipy(a: Pose3, b: Pose3) -> None:
    ra = Rotation.from_quat(xyzw_from_wxyz(a.quat_wxyz))
    rb = Rotation.from_quat(xyzw_from_wxyz(b.quat_wxyz))
    np.testing.assert_allclose(rotate_wxyz(a.quat_wxyz, b.xyz), ra.apply(b.xyz), atol=1e-10)
    product = Rotation.from_quat(xyzw_from_wxyz(multiply_wxyz(a.quat_wxyz, b.quat_wxyz)))
    assert (product.inv() * (ra * rb)).magnitude() < 1e-10


@given(poses3, poses3)
def test_composing_with_the_inverse_is_the_identity(a: Pose3, b: Pose3) -> None:
    back = a.inverse() @ (a @ b)
    np.testing.assert_allclose(back.xyz, b.xyz, atol=1e-9)
    np.testing.assert_allclose(
        matrix_from_quat_wxyz(back.quat_wxyz), matrix_from_quat_wxyz(b.quat_wxyz), atol=1e-9
    )
    np.testing.assert_allclose((a @ b).xyz, a.apply(b.xyz), atol=1e-9)


@given(poses2, poses2)
def test_planar_poses_are_spatial_poses_in_the_plane(a: Pose2, b: Pose2) -> None:
    planar, spatial = a @ b, (Pose3.from_pose2(a) @ Pose3.from_pose2(b)).to_pose2()
    assert (planar.x, planar.y) == pytest.approx((spatial.x, spatial.y), abs=1e-9)
    assert wrap_angle(planar.yaw - spatial.yaw) == pytest.approx(0.0, abs=1e-9)
    there_and_back = a @ a.inverse()
    assert tuple(there_and_back) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    np.testing.assert_allclose(a.apply([[b.x, b.y]])[0], planar[:2], atol=1e-9)


@given(angle)
def test_wrapping_keeps_the_direction(value: float) -> None:
    wrapped = wrap_angle(value)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(value))
    assert float(wrap_angles(value)) == pytest.approx(wrapped) or abs(wrapped) == pytest.approx(math.pi)


@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_rpy_round_trip(roll: float, pitch: float, yaw: float) -> None:
    quat = quat_wxyz_from_rpy(roll, pitch, yaw)
    np.testing.assert_allclose(rpy_from_quat_wxyz(quat), [roll, pitch, yaw], atol=1e-6)
    assert yaw_from_quat_wxyz(quat) == pytest.approx(yaw, abs=1e-9)


def test_quaternion_orders_are_inverse_of_each_other() -> None:
    np.testing.assert_array_equal(wxyz_from_xyzw(xyzw_from_wxyz([1, 2, 3, 4])), [1, 2, 3, 4])


def test_an_origin_that_is_not_written_is_that_of_its_parent() -> None:
    """URDF: xyz and rpy default to zeros."""
    for pose in (Pose3.from_xyz_rpy(), Pose3.from_pose2(Pose2(0.0, 0.0, 0.0))):
        assert [*pose.xyz, *pose.quat_wxyz] == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    assert Pose3.from_xyz_rpy(rpy=(0.0, 0.0, math.pi)).xyz.tolist() == [0.0, 0.0, 0.0]
    assert Pose3.from_xyz_rpy((1.0, 2.0, 3.0)).quat_wxyz.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_points_are_moved_by_the_numbers_of_the_matrix() -> None:
    rng, pose = np.random.default_rng(1), Pose2(3.0, -2.0, 0.7)
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    for count in (0, 1, 7, 360):
        points = rng.normal(size=(count, 2))
        expected = points @ np.array([[c, s], [-s, c]]) + np.array([pose.x, pose.y])
        np.testing.assert_array_equal(pose.apply(points), expected)  # to the last bit
        np.testing.assert_array_equal(pose.apply(np.asfortranarray(points)), expected)
