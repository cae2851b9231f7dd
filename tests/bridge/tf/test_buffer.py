from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from twin.bridge.bus import Bus
from twin.bridge.conversions import (
    pose2_from_pose,
    pose3_from_pose,
    pose3_from_transform,
    pose_from_pose2,
    pose_from_pose3,
    transform_from_pose3,
)
from twin.bridge.msgs import Quaternion, TFMessage, Transform, TransformStamped, Vector3, header
from twin.bridge.tf import (
    DisconnectedFramesError,
    ExtrapolationError,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformBuffer,
    TransformError,
    TransformListener,
    UnknownFrameError,
    transform_stamped,
)
from twin.errors import TwinError
from twin.geometry import Pose2, Pose3

S = 1_000_000_000
poses = st.builds(
    Pose3.from_xyz_rpy,
    st.tuples(*[st.floats(-10, 10)] * 3),
    st.tuples(*[st.floats(-math.pi, math.pi)] * 3),
)


def _assert_same(a: Pose3, b: Pose3) -> None:
    np.testing.assert_allclose(a.xyz, b.xyz, atol=1e-9)
    sign = np.sign(a.quat_wxyz @ b.quat_wxyz)
    np.testing.assert_allclose(a.quat_wxyz, sign * b.quat_wxyz, atol=1e-9)


@given(poses, poses, poses)
def test_a_lookup_composes_along_the_tree(a: Pose3, b: Pose3, c: Pose3) -> None:
    buffer = TransformBuffer()
    buffer.set_transform("map", "odom", 0, a)
    buffer.set_transform("odom", "base", 0, b)
    buffer.set_transform("base", "laser", 0, c, static=True)
    buffer.set_transform("map", "dock", 0, c, static=True)
    _assert_same(buffer.lookup("map", "laser", 0), a @ b @ c)
    _assert_same(buffer.lookup("laser", "map", 0), (a @ b @ c).inverse())
    _assert_same(buffer.lookup("dock", "base", 0), c.inverse() @ a @ b)
    _assert_same(buffer.lookup("base", "base"), Pose3.from_xyz_rpy())


@given(poses, poses, st.floats(0, 1))
def test_between_two_stamps_it_interpolates_as_slerp_does(a: Pose3, b: Pose3, ratio: float) -> None:
    buffer = TransformBuffer()
    buffer.set_transform("odom", "base", S, a)
    buffer.set_transform("odom", "base", 2 * S, b)
    time_ns = int(ratio * S)
    got = buffer.lookup("odom", "base", S + time_ns)
    np.testing.assert_allclose(got.xyz, a.xyz + (b.xyz - a.xyz) * time_ns / S, atol=1e-9)
    ends = Rotation.from_quat([a.quat_wxyz, b.quat_wxyz], scalar_first=True)
    if ends[0].inv() * ends[1] is not None and (ends[0].inv() * ends[1]).magnitude() < 3.1:
        expected = Slerp([0.0, 1.0], ends)(time_ns / S)
        difference = Rotation.from_quat(got.quat_wxyz, scalar_first=True).inv() * expected
        assert difference.magnitude() < 1e-6


def test_errors_name_the_stamps_and_the_gap() -> None:
    buffer = TransformBuffer()
    identity = Pose3.from_xyz_rpy()
    buffer.set_transform("odom", "base", 1 * S, identity)
    buffer.set_transform("odom", "base", 2 * S, identity)
    with pytest.raises(
        ExtrapolationError, match=r"from 1\.000 s to 2\.000 s; asked at 2\.500 s, 0\.500 s after the last"
    ):
        buffer.lookup("odom", "base", 2_500_000_000)
    with pytest.raises(ExtrapolationError, match=r"0\.250 s before the first"):
        buffer.lookup("base", "odom", 750_000_000)
    with pytest.raises(UnknownFrameError, match=r"'lasr' is not in the transform tree; it has: base, odom"):
        buffer.lookup("odom", "lasr")
    buffer.set_transform("map", "dock", 0, identity, static=True)
    with pytest.raises(DisconnectedFramesError, match="root 'odom'"):
        buffer.lookup("map", "base")
    assert not buffer.can_transform("map", "base")
    assert issubclass(TransformError, TwinError)
    assert issubclass(TransformError, LookupError)


def test_without_a_time_it_takes_the_latest_common_one() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("map", "odom", 1 * S, Pose3.from_xyz_rpy((10.0, 0.0, 0.0)))
    for time, x in ((0, 0.0), (1, 1.0), (2, 2.0)):
        buffer.set_transform("odom", "base", time * S, Pose3.from_xyz_rpy((x, 0.0, 0.0)))
    assert buffer.latest_common_ns("map", "base") == S
    np.testing.assert_allclose(buffer.lookup("map", "base").xyz, [11.0, 0.0, 0.0])


def test_history_is_bounded_ordered_and_keeps_the_first_of_a_stamp() -> None:
    buffer = TransformBuffer(cache_ns=10)
    for time_ns in (0, 20, 12, 20, 5, 18):
        buffer.set_transform("odom", "base", time_ns, Pose3.from_xyz_rpy((float(time_ns), 0.0, 0.0)))
    buffer.set_transform("odom", "base", 18, Pose3.from_xyz_rpy((99.0, 0.0, 0.0)))
    assert buffer.lookup("odom", "base", 18).xyz[0] == 18.0
    assert buffer.lookup("odom", "base", 15).xyz[0] == 15.0
    with pytest.raises(ExtrapolationError):
        buffer.lookup("odom", "base", 11)


def test_nonsense_is_refused() -> None:
    buffer = TransformBuffer()
    with pytest.raises(ValueError, match="child"):
        buffer.set_transform("a", "a", 0, Pose3.from_xyz_rpy())
    with pytest.raises(ValueError, match="unit"):
        buffer.set_transform("a", "b", 0, Pose3(np.zeros(3), np.zeros(4)))
    with pytest.raises(ValueError, match="finite"):
        buffer.set_transform("a", "b", 0, Pose3.from_xyz_rpy((math.nan, 0.0, 0.0)))


def test_a_loop_does_not_hang() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("a", "b", 0, Pose3.from_xyz_rpy())
    buffer.set_transform("b", "a", 0, Pose3.from_xyz_rpy())
    with pytest.raises(TransformError):
        buffer.lookup("a", "c", 0)


def test_over_the_bus(bus: Bus) -> None:
    driver, publisher, arm, late = (bus.create_node(n) for n in ("driver", "state_publisher", "arm", "late"))
    static = StaticTransformBroadcaster(publisher)
    mount = Pose3.from_xyz_rpy((0.1, 0.0, 0.2), (0.0, 0.0, math.pi))
    static.send_transform(transform_stamped("base_link", "laser", 0, mount))
    static.send_transform(transform_stamped("base_link", "imu", 0, mount))
    StaticTransformBroadcaster(arm).send_transform([transform_stamped("base_link", "arm", 0, mount)])
    buffer = TransformBuffer()
    TransformListener(buffer, late)
    broadcaster = TransformBroadcaster(driver)
    odom = Pose3.from_xyz_rpy((1.0, 2.0, 0.0), (0.0, 0.0, 0.5))
    broadcaster.send_transform([transform_stamped("odom", "base_link", 3, odom)])
    bus.spin()
    assert set(buffer.parents) == {"laser", "imu", "arm", "base_link"}
    _assert_same(buffer.lookup("odom", "laser", 3), odom @ mount)


def test_a_bad_transform_from_somebody_else_is_reported_once(
    bus: Bus, caplog: pytest.LogCaptureFixture
) -> None:
    node = bus.create_node("listener")
    buffer = TransformBuffer()
    TransformListener(buffer, node)
    bad = TransformStamped(
        header(0, "odom"), "base", Transform(Vector3(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 0.0))
    )
    publisher = bus.create_node("bad").create_publisher(TFMessage, "/tf")
    for _ in range(3):
        publisher.publish(TFMessage([bad]))
    bus.spin()
    assert buffer.parents == {}
    assert len([r for r in caplog.records if "'base'" in r.message]) == 1


@given(poses)
def test_conversions_are_inverse(pose: Pose3) -> None:
    _assert_same(pose3_from_pose(pose_from_pose3(pose)), pose)
    _assert_same(pose3_from_transform(transform_from_pose3(pose)), pose)


def test_planar_conversions() -> None:
    pose = Pose2(1.0, -2.0, 2.5)
    message = pose_from_pose2(pose)
    assert pose2_from_pose(message) == pytest.approx(pose)
    _assert_same(pose3_from_pose(message), Pose3.from_pose2(pose))


def test_planar_lookup_is_the_projection_of_the_spatial_one() -> None:
    buffer = TransformBuffer()
    buffer.set_transform("map", "odom", 0, Pose3.from_xyz_rpy((1, 2, 0), (0.1, -0.2, 2.5)), static=True)
    buffer.set_transform("odom", "base", 0, Pose3.from_xyz_rpy((-3, 1, 0.5), (0.0, 0.3, -1.0)))
    spatial = buffer.lookup("map", "base", 0).to_pose2()
    assert tuple(buffer.lookup_planar("map", "base", 0)) == pytest.approx(tuple(spatial))
