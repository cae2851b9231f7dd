"""Messages in another frame, as tf2_geometry_msgs, tf2_sensor_msgs and laser_geometry make them.

Points of a laser scan are in its own frame, or in one that it moves in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.bridge import types
from twin.bridge.conversions import pose3_from_pose, pose3_from_transform, pose_from_pose3
from twin.bridge.msgs import (
    Header,
    LaserScan,
    Odometry,
    Path,
    Point,
    PointCloud2,
    PointStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Vector3Stamped,
    header,
    ns,
)
from twin.bridge.point_cloud2 import create_cloud, fields_of, points_in
from twin.clouds.points import XYZ
from twin.errors import BridgeError, nearest, shortened
from twin.geometry import Array, Pose3, matrix_from_quat_wxyz, multiply_wxyz, rotate_wxyz

if TYPE_CHECKING:
    from twin.bridge.tf.core import BufferCore

M = TypeVar("M")
QuaternionStamped: Any = types.get("geometry_msgs/msg/QuaternionStamped")


def do_transform(message: M, transform: TransformStamped) -> M:
    """Return a message in the frame that a transform leads to; its header becomes the transform's.

    One without a header, such as a `Pose`, is taken to be in the transform's child frame.

    Raises:
        BridgeError: messages of this type have no frame, or this one is not well-formed.
    """
    function = _FUNCTIONS.get(type(message))
    if function is None:
        name = getattr(type(message), "__msgtype__", type(message).__name__)
        known = [str(getattr(cls, "__msgtype__", cls)) for cls in _FUNCTIONS]
        raise BridgeError(f"a {name} cannot be transformed; {nearest(name, known)}")
    transformed: M = function(message, pose3_from_transform(transform.transform), transform.header)
    return transformed


def rotated_covariance(covariance: Array, quat_wxyz: Array) -> Array:
    """Return the covariance, shape (36,), of x, y, z, roll, pitch, yaw in the axes of another frame."""
    rotation = np.kron(np.eye(2), matrix_from_quat_wxyz(quat_wxyz))
    return (rotation @ np.asarray(covariance, dtype=np.float64).reshape(6, 6) @ rotation.T).ravel()


def _point(message: Point, T: Pose3, _: Header | None = None) -> Point:
    x, y, z = (rotate_wxyz(T.quat_wxyz, (message.x, message.y, message.z)) + T.xyz).tolist()
    return Point(x, y, z)


def _vector3(message: Vector3, T: Pose3, _: Header | None = None) -> Vector3:
    x, y, z = rotate_wxyz(T.quat_wxyz, (message.x, message.y, message.z)).tolist()
    return Vector3(x, y, z)


def _quaternion(message: Quaternion, T: Pose3, _: Header | None = None) -> Quaternion:
    w, x, y, z = multiply_wxyz(T.quat_wxyz, (message.w, message.x, message.y, message.z)).tolist()
    return Quaternion(x, y, z, w)


def _pose(message: Pose, T: Pose3, _: Header | None = None) -> Pose:
    return pose_from_pose3(T @ pose3_from_pose(message))


def _with_covariance(message: PoseWithCovariance, T: Pose3, _: Header | None = None) -> PoseWithCovariance:
    return PoseWithCovariance(_pose(message.pose, T), rotated_covariance(message.covariance, T.quat_wxyz))


def _path(message: Path, T: Pose3, header: Header) -> Path:
    """Every pose is taken to be in the path's frame, as planners publish it; their stamps are kept."""
    poses = [
        PoseStamped(Header(pose.header.stamp, header.frame_id), _pose(pose.pose, T)) for pose in message.poses
    ]
    return Path(header, poses)


def _moved_cloud(message: PointCloud2, T: Pose3, header: Header) -> PointCloud2:
    return replace(moved(message, T), header=header)


_FUNCTIONS: dict[type, Callable[[Any, Pose3, Header], Any]] = {
    Point: _point,
    Vector3: _vector3,
    Quaternion: _quaternion,
    Pose: _pose,
    PoseWithCovariance: _with_covariance,
    PointStamped: lambda m, T, h: PointStamped(h, _point(m.point, T)),
    Vector3Stamped: lambda m, T, h: Vector3Stamped(h, _vector3(m.vector, T)),
    QuaternionStamped: lambda m, T, h: QuaternionStamped(h, _quaternion(m.quaternion, T)),
    PoseStamped: lambda m, T, h: PoseStamped(h, _pose(m.pose, T)),
    PoseWithCovarianceStamped: lambda m, T, h: PoseWithCovarianceStamped(h, _with_covariance(m.pose, T)),
    PoseArray: lambda m, T, h: PoseArray(h, [_pose(pose, T) for pose in m.poses]),
    Path: _path,
    # The twist is in the child frame, which stays what it is.
    Odometry: lambda m, T, h: Odometry(h, m.child_frame_id, _with_covariance(m.pose, T), m.twist),
    PointCloud2: _moved_cloud,
}


def moved(cloud: PointCloud2, T_target_source: Pose3) -> PointCloud2:
    """Return a cloud with its x, y, z moved and all other fields kept; normals are not turned, as in tf2.

    Raises:
        BridgeError: there is no x, y, z of floating-point type, or less data than its sizes say.
    """
    data = np.array(cloud.data, dtype=np.uint8)
    fields = _coordinates(cloud, data)
    # NaN marks a point that was not measured, and stays NaN.
    points = np.stack([np.asarray(field, dtype=np.float64) for field in fields], axis=-1)
    out = T_target_source.apply(points.reshape(-1, 3)).reshape(points.shape)
    for axis, field in enumerate(fields):
        field[...] = out[..., axis]
    return replace(cloud, data=data)


def _coordinates(cloud: PointCloud2, data: np.ndarray) -> list[np.ndarray]:
    """Return x, y, z as views of the data, shape (height, width)."""
    points = points_in(cloud, data)
    names = points.dtype.names or ()
    for name in XYZ:
        if name not in names or points.dtype[name].kind != "f":
            raise BridgeError(
                f"the cloud has no floating-point field {name!r}; its fields: {shortened(names) or 'none'}"
            )
    return [points[name] for name in XYZ]


Indices = NDArray[np.intp]


def project_laser(scan: LaserScan, *, range_cutoff: float = -1.0) -> PointCloud2:
    """Return a scan's points in its own frame, with the fields x, y, z, intensity (if there) and index.

    A ray whose range is not in [range_min, range_cutoff), such as inf and NaN, has no point.

    Args:
        scan: The scan; z is its axis, whichever way the lidar is mounted.
        range_cutoff: [m]; negative: the scan's range_max.
    """
    kept, points = _polar(scan, range_cutoff)
    return _cloud(scan, scan.header.frame_id, kept, points)


def transform_laser_scan(
    buffer: BufferCore, target: str, scan: LaserScan, *, range_cutoff: float = -1.0
) -> PointCloud2:
    """Return a scan's points in another frame, each ray from where the lidar was when it was measured.

    The lidar's pose at the first ray and at the last are looked up; between them it moves steadily, as
    laser_geometry's transformLaserScanToPointCloud has it. The header keeps the first ray's stamp.

    Args:
        buffer: Transforms.
        target: Frame of the points; one that does not move with the robot, such as odom.
        scan: The scan.
        range_cutoff: [m]; negative: the scan's range_max.

    Raises:
        TransformError: no transform for the first or the last ray.
    """
    rays = len(scan.ranges)
    first_ns = ns(scan.header.stamp)
    last_ns = first_ns + round(max(rays - 1, 0) * float(scan.time_increment) * 1e9)
    start = buffer.lookup(target, scan.header.frame_id, first_ns)
    end = buffer.lookup(target, scan.header.frame_id, last_ns)
    kept, points = _polar(scan, range_cutoff)
    ratio = kept / max(rays - 1, 1)
    return _cloud(scan, target, kept, _moving(points, start, end, ratio))


def _polar(scan: LaserScan, range_cutoff: float) -> tuple[Indices, Array]:
    """Return the indices of rays that hit something, and their points, shape (n, 3)."""
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    cutoff = scan.range_max if range_cutoff < 0.0 else range_cutoff
    kept = np.flatnonzero((ranges < cutoff) & (ranges >= scan.range_min))
    angles = scan.angle_min + kept * scan.angle_increment
    flat = np.zeros_like(angles)
    return kept, np.stack([np.cos(angles), np.sin(angles), flat], axis=-1) * ranges[kept, None]


def _moving(points: Array, start: Pose3, end: Pose3, ratio: Array) -> Array:
    """Return points that were each measured from a pose between two."""
    dot = float(start.quat_wxyz @ end.quat_wxyz)
    angle = float(np.arccos(min(1.0, abs(dot))))
    if angle == 0.0:
        quats = np.broadcast_to(start.quat_wxyz, (len(points), 4))
    else:
        far = end.quat_wxyz if dot >= 0.0 else -end.quat_wxyz
        a, b = np.sin((1.0 - ratio) * angle), np.sin(ratio * angle)
        quats = (a[:, None] * start.quat_wxyz + b[:, None] * far) / np.sin(angle)
    w, axis = quats[:, :1], quats[:, 1:]
    twice = 2.0 * np.cross(axis, points)
    origin = start.xyz + ratio[:, None] * (end.xyz - start.xyz)
    return points + w * twice + np.cross(axis, twice) + origin


def _cloud(scan: LaserScan, frame: str, kept: Indices, points: Array) -> PointCloud2:
    columns: list[tuple[str, str, NDArray[Any]]] = [
        (name, "<f4", points[:, axis]) for axis, name in enumerate("xyz")
    ]
    if len(scan.intensities):
        columns.append(("intensity", "<f4", np.asarray(scan.intensities)[kept]))
    columns.append(("index", "<i4", kept))
    points_of_rays = np.zeros(len(kept), dtype=[(name, kind) for name, kind, _ in columns])
    for name, _, values in columns:
        points_of_rays[name] = values
    return create_cloud(header(ns(scan.header.stamp), frame), fields_of(points_of_rays.dtype), points_of_rays)
