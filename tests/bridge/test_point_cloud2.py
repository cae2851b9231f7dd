"""PointCloud2 as drivers and PCL lay it out, read and made with sensor_msgs_py's functions."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from twin.bridge.laser_scans import SliceConfig, scan_of
from twin.bridge.msgs import LaserScan, PointCloud2, PointField, header
from twin.bridge.point_cloud2 import (
    cloud_of,
    create_cloud,
    create_cloud_xyz32,
    dtype_from_fields,
    read_points,
    read_points_numpy,
)
from twin.bridge.tf.transforms import project_laser
from twin.clouds.colours import channels
from twin.clouds.points import coordinates, make_points
from twin.errors import BridgeError

HERE = header(7_000_000_000, "velodyne")


def message(
    fields: list[tuple[str, int, int, int]], step: int, rows: list[bytes], **other: Any
) -> PointCloud2:
    return PointCloud2(
        **{
            "header": HERE,
            "height": len(rows),
            "width": len(rows[0]) // step,
            "fields": [PointField(*field) for field in fields],
            "is_bigendian": False,
            "point_step": step,
            "row_step": len(rows[0]),
            "data": np.frombuffer(b"".join(rows), np.uint8),
            "is_dense": False,
            **other,
        }
    )


def pcl_xyzrgb() -> PointCloud2:
    """Return an organised cloud of pcl::PointXYZRGB: 16 bytes, the colour, then padding up to 32."""
    points = [struct.pack("<3f4xI12x", x, y, 1.0, 0x00102030 + x) for y in range(2) for x in range(3)]
    fields = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("rgb", 16, 7, 1)]
    return message(fields, 32, [b"".join(points[:3]), b"".join(points[3:])])


def test_an_organised_cloud_of_pcl_is_read_with_its_colours() -> None:
    cloud = pcl_xyzrgb()
    points = read_points(cloud, reshape_organized_cloud=True)
    assert points.shape == (2, 3)
    assert points["x"][1].tolist() == [0, 1, 2]
    assert points["y"][:, 0].tolist() == [0, 1]
    assert channels(points["rgb"])[2].tolist() == [0x10, 0x20, 0x32, 0]
    assert read_points(cloud).shape == (6,)


def test_a_driver_s_odd_layout_is_read() -> None:
    """ring, time and echo before the coordinates, two bytes in between, rows with an end of their own."""
    rows = [struct.pack("<Hfb2x3f", ring, 0.1, -3, 1, 2, 3 + ring) + b"\xee" * 5 for ring in (4, 9)]
    fields = [("ring", 0, 4, 1), ("time", 2, 7, 1), ("echo", 6, 1, 1)]
    fields += [(axis, 9 + 4 * i, 7, 1) for i, axis in enumerate("xyz")]
    cloud = message(fields, 21, rows, width=1)
    assert read_points(cloud, ("z", "ring")).tolist() == [(7.0, 4), (12.0, 9)]
    assert read_points(cloud)["echo"].tolist() == [-3, -3]


def test_big_endian_numbers_and_fields_of_several_are_read() -> None:
    cloud = message(
        [("p", 0, 8, 2), ("", 16, 3, 1)], 18, [struct.pack(">2dh", 1.5, -2.5, 300)], is_bigendian=True
    )
    points = read_points(cloud)
    assert points.dtype.names == ("p_0", "p_1", "unnamed_field_1")
    assert points.tolist() == [(1.5, -2.5, 300)]
    assert points.dtype["p_0"].isnative


def test_points_are_chosen_by_index_and_by_what_was_measured() -> None:
    cloud = create_cloud_xyz32(HERE, [(0, 0, 0), (math.nan, 1, 1), (2, 2, 2), (3, 3, math.nan)])
    assert read_points_numpy(cloud, skip_nans=True).tolist() == [[0, 0, 0], [2, 2, 2]]
    assert read_points_numpy(cloud, ("x",), skip_nans=True).tolist() == [[0], [2], [3]]
    assert read_points_numpy(cloud, uvs=[2, 0]).tolist() == [[2, 2, 2], [0, 0, 0]]
    assert len(read_points(replace(cloud, is_dense=True), skip_nans=True)) == 4


def test_clouds_are_made_as_sensor_msgs_py_makes_them() -> None:
    cloud = create_cloud_xyz32(HERE, np.arange(6.0).reshape(2, 3))
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 2, 12, 24)
    assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == [
        ("x", 0, 7, 1),
        ("y", 4, 7, 1),
        ("z", 8, 7, 1),
    ]
    assert cloud.data.tobytes() == struct.pack("<6f", *range(6))
    fields = [PointField("a", 1, 2, 1), PointField("b", 4, 7, 1)]
    assert create_cloud(HERE, fields, [(1, 2.0)], step=9).data.tobytes() == struct.pack("<xB2xfx", 1, 2.0)
    assert create_cloud_xyz32(HERE, []).width == 0


def test_a_structured_array_becomes_a_message_and_comes_back() -> None:
    points = np.zeros((2, 3), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("label", ">i4"), ("time", "<f8")])
    points["label"], points["time"] = -5, np.arange(6).reshape(2, 3)
    cloud = cloud_of(HERE, points)
    assert cloud.is_dense
    back = read_points(cloud, reshape_organized_cloud=True)
    assert back.tolist() == points.tolist()
    points["y"][1, 1] = math.nan
    assert not cloud_of(HERE, points).is_dense


def huge() -> PointCloud2:
    return replace(pcl_xyzrgb(), height=2**31, width=2**31, row_step=2**36)


@pytest.mark.parametrize(
    ("cloud", "said"),
    [
        (huge(), r"the cloud has 192 bytes; 2147483648 rows of 2147483648 points"),
        (
            replace(pcl_xyzrgb(), row_step=90),
            r"the cloud has 192 bytes; 2 rows of 3 points of 32 bytes, 90 a row",
        ),
        (
            replace(pcl_xyzrgb(), fields=[PointField("x", 30, 7, 1)]),
            r"the field 'x' ends after the point's 32 bytes",
        ),
        (
            replace(pcl_xyzrgb(), fields=[PointField("x", 0, 9, 1)]),
            r"the field 'x' has datatype 9; valid is 1",
        ),
        (
            replace(pcl_xyzrgb(), fields=[PointField("x", 0, 7, 2**31)]),
            r"the field 'x' has 2147483648 numbers",
        ),
        (replace(pcl_xyzrgb(), fields=[PointField("x", 0, 7, 1)] * 2), r"the cloud has two fields 'x'"),
    ],
)
def test_a_message_that_lies_is_refused(cloud: PointCloud2, said: str) -> None:
    with pytest.raises(BridgeError, match=said):
        read_points(cloud)


def test_what_does_not_fit_is_refused() -> None:
    cloud = pcl_xyzrgb()
    with pytest.raises(BridgeError, match="no field 'q'; its fields: x, y, z, rgb"):
        read_points(cloud, ("x", "q"))
    with pytest.raises(BridgeError, match=r"uvs go from 0 to 6; the cloud has 6 points"):
        read_points(cloud, uvs=[0, 6])
    with pytest.raises(BridgeError, match="of several types"):
        read_points_numpy(create_cloud(HERE, [PointField("a", 0, 2, 1), PointField("b", 1, 7, 1)], [(1, 2)]))
    with pytest.raises(BridgeError, match=r"shape \(1, 2\); valid is \(n, 3\)"):
        create_cloud_xyz32(HERE, [(1, 2)])
    with pytest.raises(BridgeError, match=r"'x' is of int64; a message has integers of up to 4 bytes"):
        cloud_of(HERE, make_points([(1,)], ("x",), np.int64))
    assert dtype_from_fields([]).itemsize == 0


def test_a_scan_becomes_a_cloud_and_again_the_scan() -> None:
    ranges = np.array([math.inf, 1.0, 2.0, 0.01, 3.0, math.nan], np.float32)
    low, step = -0.5, 0.2
    scan = LaserScan(HERE, low, 0.5, step, 0.0, 0.1, 0.05, 10.0, ranges, np.zeros(0, np.float32))
    cloud = project_laser(scan)
    assert read_points(cloud)["index"].tolist() == [1, 2, 4]
    # A ray of the slice is as wide as the space between two of the scan, with that in its middle.
    config = SliceConfig(
        angle_min=low - step / 2, angle_max=low + 5.4 * step, angle_increment=step, range_max=10.0
    )
    back = scan_of(cloud, config)
    assert back.ranges.tolist() == pytest.approx([math.inf, 1.0, 2.0, math.inf, 3.0, math.inf])
    assert back.header == HERE


def test_a_slice_has_the_nearest_point_of_its_height() -> None:
    cloud = create_cloud_xyz32(HERE, [(2, 0, 0), (1, 0, 5), (3, 0, 0.2), (0, 4, 0), (math.nan, 0, 0)])
    scan = scan_of(cloud, SliceConfig(angle_min=-0.1, angle_max=0.1, angle_increment=0.2, max_height=1.0))
    assert scan.ranges.tolist() == [2.0]
    far = SliceConfig(
        angle_min=-0.1, angle_max=0.1, angle_increment=0.2, range_min=4.0, range_max=9.0, use_inf=False
    )
    assert scan_of(cloud, far).ranges.tolist() == [pytest.approx(math.hypot(1, 0) + 9.0)]
    assert coordinates(read_points(cloud)).shape == (5, 3)
    with pytest.raises(BridgeError, match="is no scan"):
        SliceConfig(angle_increment=0.0)
