"""Points of a laser scan, as laser_geometry makes them: in its own frame, and in one that it moves in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge.msgs import LaserScan, PointCloud2, PointField, header, ns
from twin.geometry import Array, Pose3

if TYPE_CHECKING:
    from twin.bridge.tf.core import BufferCore

Indices = NDArray[np.intp]
_INT32, _FLOAT32 = 5, 7


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
    packed = np.zeros(len(kept), dtype=[(name, kind) for name, kind, _ in columns])
    for name, _, values in columns:
        packed[name] = values
    step = packed.dtype.itemsize
    fields = [
        PointField(name, 4 * place, _INT32 if kind == "<i4" else _FLOAT32, 1)
        for place, (name, kind, _) in enumerate(columns)
    ]
    return PointCloud2(
        header=header(ns(scan.header.stamp), frame),
        height=1,
        width=len(kept),
        fields=fields,
        is_bigendian=False,
        point_step=step,
        row_step=step * len(kept),
        data=np.frombuffer(packed.tobytes(), dtype=np.uint8),
        is_dense=False,
    )
