"""Messages, scans and clouds in other frames."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.bridge.msgs import (
    LaserScan,
    Odometry,
    Path,
    Point,
    PointCloud2,
    PointField,
    PointStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    String,
    Vector3,
    Vector3Stamped,
    header,
    new,
)
from twin.bridge.tf import ExtrapolationError, TransformBuffer
from twin.bridge.tf.transforms import QuaternionStamped, _coordinates, do_transform, project_laser
from twin.errors import BridgeError
from twin.geometry import Pose3

S = 1_000_000_000
quarter_turn = Pose3.from_xyz_rpy((10.0, 0.0, 1.0), (0.0, 0.0, math.pi / 2.0))
poses = st.builds(
    Pose3.from_xyz_rpy,
    st.tuples(*[st.floats(-10, 10)] * 3),
    st.tuples(*[st.floats(-math.pi, math.pi)] * 3),
)


@pytest.fixture
def buffer() -> TransformBuffer:
    buffer = TransformBuffer()
    buffer.set_transform("map", "base", 5 * S, quarter_turn)
    return buffer


def points_of(cloud: PointCloud2) -> np.ndarray:
    """Shape (height * width, 3)."""
    fields = _coordinates(cloud, np.array(cloud.data, dtype=np.uint8))
    return np.stack([np.asarray(field, dtype=np.float64).ravel() for field in fields], axis=-1)


def cloud(
    points: Any, *, kind: str = "<f4", height: int = 1, padding: int = 0, frame: str = "base"
) -> PointCloud2:
    """Return a cloud with an `intensity` before and a `ring` after the coordinates, rows padded."""
    points = np.asarray(points, dtype=float).reshape(height, -1, 3)
    dtype = np.dtype([("intensity", "<f4"), *((axis, kind) for axis in "xyz"), ("ring", "<u2")])
    packed = np.zeros(points.shape[:2], dtype)
    for axis, name in enumerate("xyz"):
        packed[name] = points[..., axis]
    packed["intensity"], packed["ring"] = 0.5, np.arange(points.shape[1])
    rows = [row.tobytes() + b"\xee" * padding for row in packed]
    number = 7 if kind.endswith("f4") else 8
    assert dtype.fields is not None
    fields = [
        PointField(name, dtype.fields[name][1], {"ring": 4, "intensity": 7}.get(name, number), 1)
        for name in dtype.names or ()
    ]
    return PointCloud2(
        header=header(5 * S, frame),
        height=height,
        width=points.shape[1],
        fields=fields,
        is_bigendian=kind.startswith(">"),
        point_step=dtype.itemsize,
        row_step=len(rows[0]),
        data=np.frombuffer(b"".join(rows), dtype=np.uint8),
        is_dense=False,
    )


def test_points_vectors_rotations_and_poses(buffer: TransformBuffer) -> None:
    here = header(5 * S, "base")
    point = buffer.transform(PointStamped(here, Point(1.0, 2.0, 3.0)), "map")
    assert point.header == header(5 * S, "map")
    assert (point.point.x, point.point.y, point.point.z) == pytest.approx((8.0, 1.0, 4.0))
    vector = buffer.transform(Vector3Stamped(here, Vector3(1.0, 2.0, 3.0)), "map").vector
    assert (vector.x, vector.y, vector.z) == pytest.approx((-2.0, 1.0, 3.0))
    turned = buffer.transform(QuaternionStamped(here, Quaternion(0.0, 0.0, 0.0, 1.0)), "map").quaternion
    assert (turned.z, turned.w) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    ahead = Pose(Point(1.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
    for message in (
        PoseStamped(here, ahead),
        PoseArray(here, [ahead]),
        Path(here, [PoseStamped(header(3 * S, "base"), ahead)]),
        Odometry(here, "wheel", PoseWithCovariance(ahead, np.zeros(36)), new(Odometry).twist),
    ):
        moved = buffer.transform(message, "map")
        assert moved.header == header(5 * S, "map")
        pose = moved.pose if hasattr(moved, "pose") else moved.poses[0]
        while not hasattr(pose, "position"):
            pose = pose.pose
        assert (pose.position.x, pose.position.y, pose.position.z) == pytest.approx((10.0, 1.0, 1.0))
        assert pose.orientation.z == pytest.approx(math.sqrt(0.5))


@given(poses)
def test_a_covariance_turns_with_its_pose(T: Pose3) -> None:
    buffer = TransformBuffer()
    buffer.set_transform("map", "base", 0, T, static=True)
    spread = np.diag([4.0, 1.0, 0.25, 0.1, 0.2, 0.3])
    message = PoseWithCovarianceStamped(header(0, "base"), PoseWithCovariance(new(Pose), spread.ravel()))
    moved = buffer.transform(message, "map").pose.covariance.reshape(6, 6)
    rotation = np.column_stack([T.apply(axis) - T.xyz for axis in np.eye(3)])
    for block in (slice(0, 3), slice(3, 6)):
        np.testing.assert_allclose(
            moved[block, block], rotation @ spread[block, block] @ rotation.T, atol=1e-12
        )
    assert np.trace(moved) == pytest.approx(np.trace(spread))


def test_as_seen_at_another_time_from_something_that_moves(buffer: TransformBuffer) -> None:
    buffer.set_transform("map", "base", 6 * S, Pose3.from_xyz_rpy((20.0, 0.0, 0.0)))
    cup = PointStamped(header(5 * S, "base"), Point(1.0, 0.0, 0.0))
    later = buffer.transform_full(cup, "base", 6 * S, "map")
    assert later.header == header(6 * S, "base")
    assert (later.point.x, later.point.y, later.point.z) == pytest.approx((-10.0, 1.0, 1.0))
    stamped = buffer.lookup_transform_full("base", 6 * S, "base", cup.header.stamp, "map")
    assert stamped.header == header(6 * S, "base")
    assert stamped.transform.translation.x == pytest.approx(-10.0)


def test_what_has_no_frame_is_refused(buffer: TransformBuffer) -> None:
    with pytest.raises(BridgeError, match="no header"):
        buffer.transform(String("x"), "map")
    with pytest.raises(BridgeError, match="std_msgs/msg/String cannot be transformed"):
        do_transform(String("x"), buffer.lookup_transform("map", "base"))
    with pytest.raises(BridgeError, match="transform_laser_scan"):
        buffer.transform(scan([1.0]), "map")


@pytest.mark.parametrize("kind", ["<f4", ">f4", "<f8"])
@pytest.mark.parametrize(("height", "padding"), [(1, 0), (2, 7)])
def test_a_cloud_of_any_layout(buffer: TransformBuffer, kind: str, height: int, padding: int) -> None:
    points = np.array([[1.0, 2.0, 3.0], [math.nan] * 3, [0.0, 0.0, 0.0], [4.0, -5.0, 6.0]])
    before = cloud(points, kind=kind, height=height, padding=padding)
    kept = before.data.copy()
    after = buffer.transform(before, "map")
    np.testing.assert_array_equal(before.data, kept)
    np.testing.assert_allclose(points_of(after), quarter_turn.apply(points), atol=1e-5)
    assert after.header == header(5 * S, "map")
    assert (after.height, after.width, after.fields) == (height, 4 // height, before.fields)
    changed = np.flatnonzero(after.data != before.data)
    place, size = changed % before.row_step, 3 * int(kind[-1])
    assert (place < before.width * before.point_step).all()
    assert ((place % before.point_step >= 4) & (place % before.point_step < 4 + size)).all()


def test_a_cloud_that_is_not_well_formed_is_refused(buffer: TransformBuffer) -> None:
    whole = cloud([[1.0, 2.0, 3.0]])
    whole.data = whole.data[:-1]
    with pytest.raises(BridgeError, match=r"the cloud has \d+ bytes"):
        buffer.transform(whole, "map")
    flat = cloud([[1.0, 2.0, 3.0]])
    flat.fields = [field for field in flat.fields if field.name != "z"]
    with pytest.raises(BridgeError, match="no floating-point field 'z'; its fields: intensity, x, y, ring"):
        buffer.transform(flat, "map")
    late = cloud([[1.0, 2.0, 3.0]])
    late.fields[3].offset = 4000
    with pytest.raises(BridgeError, match="ends after the point"):
        buffer.transform(late, "map")
    assert buffer.transform(cloud(np.empty((0, 3))), "map").width == 0


def scan(ranges: list[float], **changes: Any) -> LaserScan:
    values: dict[str, Any] = {
        "header": header(5 * S, "laser"),
        "angle_min": -math.pi / 2,
        "angle_max": math.pi / 2,
        "angle_increment": math.pi / max(len(ranges) - 1, 1),
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": np.array(ranges, dtype=np.float32),
        "intensities": np.arange(len(ranges), dtype=np.float32),
    }
    return LaserScan(**{**values, **changes})


def test_only_rays_within_the_limits_have_points() -> None:
    message = scan([1.0, 0.05, math.inf, math.nan, 10.0, -math.inf, 2.0])
    got = project_laser(message)
    assert got.header == message.header
    np.testing.assert_allclose(points_of(got), [[0.0, -1.0, 0.0], [0.0, 2.0, 0.0]], atol=1e-6)
    assert [field.name for field in got.fields] == ["x", "y", "z", "intensity", "index"]
    packed = got.data.view([("xyz", "<f4", 3), ("intensity", "<f4"), ("index", "<i4")])
    assert packed["index"].tolist() == [0, 6]
    assert packed["intensity"].tolist() == [0.0, 6.0]
    assert project_laser(message, range_cutoff=1.5).width == 1
    assert project_laser(scan([])).width == 0


def test_a_lidar_that_hangs_upside_down(buffer: TransformBuffer) -> None:
    mount = Pose3.from_xyz_rpy((0.5, 0.0, 0.2), (math.pi, 0.0, 0.0))
    buffer.set_transform("base", "laser", 0, mount, static=True)
    got = points_of(buffer.transform_laser_scan(scan([1.0, 2.0, 3.0]), "base"))
    # Its first ray points to its right, which is the robot's left.
    np.testing.assert_allclose(got, [[0.5, 1.0, 0.2], [2.5, 0.0, 0.2], [0.5, -3.0, 0.2]], atol=1e-6)


def test_each_ray_is_seen_from_where_the_lidar_was_then() -> None:
    buffer = TransformBuffer()
    wall = 3.0
    speed, turn = 1.0, 0.4
    for time in (5, 6):
        t = time - 5.0
        buffer.set_transform(
            "odom", "laser", time * S, Pose3.from_xyz_rpy((speed * t, 0.0, 0.0), (0.0, 0.0, turn * t))
        )
    rays = 11
    times = np.arange(rays) * 0.1
    angles = np.linspace(-0.5, 0.5, rays)
    ranges = (wall - speed * times) / np.cos(angles + turn * times)
    message = scan(ranges.tolist(), angle_min=-0.5, angle_max=0.5, angle_increment=0.1, time_increment=0.1)
    straight = points_of(buffer.transform_laser_scan(message, "odom"))
    np.testing.assert_allclose(straight[:, 0], wall, atol=1e-5)
    at_once = buffer.lookup("odom", "laser", 5 * S).apply(points_of(project_laser(message)))
    assert np.ptp(at_once[:, 0]) > 0.4
    with pytest.raises(ExtrapolationError, match=r"asked at 6\.200 s"):
        buffer.transform_laser_scan(scan([1.0] * 13, time_increment=0.1), "odom")
