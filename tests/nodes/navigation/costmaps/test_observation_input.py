"""A costmap's clouds: placed by the transforms at their stamps, kept, missed, refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench, Robot, open_room
from twin.bridge.msgs import LaserScan, PointCloud2, PointField, VoxelGrid, header, new
from twin.bridge.point_cloud2 import create_cloud, create_cloud_xyz32
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import ClearEntireCostmap
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.geometry import Pose3, quat_wxyz_from_rpy
from twin.navigation.costmaps.costmap_config import CostmapConfig, VoxelConfig
from twin.navigation.costmaps.observation import ObservationSource
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.costmap import CostmapNode

LAYERS = CostmapConfig(
    rolling_window=True,
    inflation_radius=0.0,
    voxel_layer=VoxelConfig(z_resolution=0.1, z_voxels=16, publish_voxel_map=True),
)


class Looking:
    """A robot with a camera that looks along +x from 0.3 m, its optical frame turned as REP-103 says."""

    def __init__(self, bench: Bench, layers: CostmapConfig = LAYERS, **source: Any) -> None:
        self.bench, self.robot = bench, Robot(bench, open_room())
        self.robot.blind = True
        look = Pose3(np.array((0.2, 0.0, 0.3)), quat_wxyz_from_rpy(-math.pi / 2, 0.0, -math.pi / 2))
        StaticTransformBroadcaster(bench.node).send_transform(
            transform_stamped("base_footprint", "optical", 0, look)
        )
        sources = (ObservationSource(**{"topic": "points", "clearing": True} | source),)
        config = CostmapNodeConfig(
            name="local_costmap", frame="odom", layers=layers, observation_sources=sources
        )
        self.node = CostmapNode(bench.bus, self.robot.pose_lookup, config)
        self.cloud = bench.node.create_publisher(PointCloud2, "points", SENSOR_DATA)
        bench.run(0.2)

    def show(self, *points: tuple[float, float, float], ago_ns: int = TICK_NS) -> None:
        stamp = header(self.bench.clock.now_ns - ago_ns, "optical")
        self.cloud.publish(create_cloud_xyz32(stamp, points))
        self.bench.run(0.4)

    def cost(self, x: float, y: float) -> int:
        assert self.node.costmap is not None
        return self.node.costmap.cost_at(x, y)


def test_a_cloud_is_turned_and_raised_to_where_it_was_seen(bench: Bench) -> None:
    looking = Looking(bench)
    looking.show((0.21, -0.25, 1.0), (math.nan,) * 3)
    assert looking.cost(1.2, -0.21) == 254
    assert looking.node.costmap is not None
    assert np.count_nonzero(looking.node.costmap.costs == 254) == 1
    looking.show((math.nan,) * 3, (math.inf,) * 3)
    assert looking.cost(1.2, -0.21) == 254, "nothing seen, nothing cleared"
    looking.show((0.42, -0.5, 2.0))
    assert looking.cost(1.2, -0.21) == 0


def test_what_is_too_high_or_too_low_does_not_mark(bench: Bench) -> None:
    looking = Looking(bench, min_obstacle_height=0.1, max_obstacle_height=0.6)
    looking.show((0.2, 0.29, 1.0), (0.0, -0.4, 1.0), (-0.2, -0.2, 1.0))
    assert [looking.cost(1.2, y) for y in (-0.2, 0.0, 0.2)] == [0, 0, 254]


def test_the_voxels_are_published(bench: Bench) -> None:
    grids = bench.listen(VoxelGrid, "local_costmap/voxel_grid", LATCHED)
    looking = Looking(bench)
    looking.show((0.21, -0.25, 1.0))
    bench.run(1.0)
    grid = grids[-1]
    assert (grid.header.frame_id, grid.size_z, len(grid.data)) == ("odom", 16, grid.size_x * grid.size_y)
    (index,) = np.flatnonzero(np.asarray(grid.data) >> 16)
    row, column = divmod(int(index), grid.size_x)
    cell = grid.origin.x + (column + 0.5) * 0.05, grid.origin.y + (row + 0.5) * 0.05
    assert np.allclose(cell, (1.2, -0.21), atol=0.03)
    assert int(grid.data[index]) >> 16 == 1 << 5, "0.5 m is in the sixth voxel of 0.1 m"


def test_a_scan_can_be_a_source_of_voxels(bench: Bench) -> None:
    looking = Looking(bench, topic="other_scan", data_type="LaserScan", inf_is_valid=True)
    publisher = bench.node.create_publisher(LaserScan, "other_scan", SENSOR_DATA)
    for distance, want in ((1.0, 254), (math.inf, 0)):
        publisher.publish(
            LaserScan(
                header=header(bench.clock.now_ns - TICK_NS, "lidar"),
                angle_min=0.0,
                angle_max=0.0,
                angle_increment=0.1,
                time_increment=0.0,
                scan_time=0.1,
                range_min=0.1,
                range_max=5.0,
                ranges=np.array([distance], dtype=np.float32),
                intensities=np.zeros(0, dtype=np.float32),
            )
        )
        bench.run(0.4)
        assert looking.cost(1.101, 0.001) == want


def test_what_persists_is_marked_again(bench: Bench) -> None:
    looking = Looking(bench, observation_persistence=1.0)
    looking.show((0.21, -0.25, 1.0))
    looking.show((0.42, -0.5, 2.0))
    assert looking.cost(1.2, -0.21) == 254
    bench.run(1.5)
    looking.show((0.42, -0.5, 2.0))
    assert looking.cost(1.2, -0.21) == 0


def test_what_was_cleared_by_a_service_comes_back_with_the_next_picture_only(bench: Bench) -> None:
    looking = Looking(bench)
    looking.show((0.21, -0.25, 1.0))
    bench.run(0.5)
    service = "local_costmap/clear_entirely_local_costmap"
    bench.call(ClearEntireCostmap, service, new(ClearEntireCostmap.Request))
    bench.run(0.5)
    assert looking.cost(1.2, -0.21) == 0
    looking.show((0.21, -0.25, 1.0))
    assert looking.cost(1.2, -0.21) == 254


def test_nobody_drives_by_a_camera_that_is_silent(bench: Bench) -> None:
    looking = Looking(bench, expected_update_rate=0.5)
    looking.show((0.21, -0.25, 1.0))
    assert looking.node.fault == ""
    bench.run(0.5)
    assert looking.node.fault.startswith("no PointCloud2 on /points for 0.")


def test_a_cloud_without_coordinates_is_refused_in_a_sentence(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    looking = Looking(bench)
    fields = [PointField("x", 0, PointField.FLOAT32, 1)]
    for _ in range(2):
        looking.cloud.publish(create_cloud(header(bench.clock.now_ns - TICK_NS, "optical"), fields, [[1.0]]))
        bench.run(0.3)
    assert caplog.messages == ["/points is not used: the cloud has no field 'y'; its fields: x"], "once"
