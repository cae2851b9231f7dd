"""Lidars with layers in robot files, in the words of classic Gazebo, of its plugins and of new Gazebo."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import load
from twin.models.description import RobotDescription
from twin.sensors.lidar import LidarSpec
from twin.sensors.multi_layer_lidar import MultiLayerLidarSpec

ACROSS = (
    "<horizontal><samples>1875</samples><min_angle>-3.1</min_angle><max_angle>3.1</max_angle></horizontal>"
)
UPWARDS = "<vertical><samples>16</samples><min_angle>-0.26</min_angle><max_angle>0.26</max_angle></vertical>"
REACH = "<range><min>0.3</min><max>131</max></range>"


def robot(tmp_path: Path, kind: str, scan: str, more: str = "", *, rate: float = 10) -> RobotDescription:
    path = tmp_path / "robot.urdf"
    ray = "lidar" if kind == "gpu_lidar" else "ray"
    path.write_text(
        f"<robot name='r'><link name='velodyne'/><gazebo reference='velodyne'>"
        f"<sensor name='vlp' type='{kind}'><update_rate>{rate}</update_rate>"
        f"<{ray}><scan>{scan}</scan>{REACH}</{ray}>{more}</sensor></gazebo></robot>"
    )
    return load(path)


TOPICS = (
    "<topicName>/velodyne_points</topicName>",
    "<ros><remapping>~/out:=/velodyne_points</remapping></ros>",
)


@pytest.mark.parametrize("library", ["gazebo_ros_velodyne_laser", "gazebo_ros_velodyne_gpu_laser"])
@pytest.mark.parametrize("topic", TOPICS)
def test_velodyne_s_plugins_make_a_cloud_and_no_scan(library: str, topic: str, tmp_path: Path) -> None:
    plugin = (
        f"<plugin filename='lib{library}.so'>{topic}<frameName>lens</frameName><min_range>0.9</min_range>"
        "<max_range>130.0</max_range><gaussianNoise>0.008</gaussianNoise></plugin>"
    )
    (spec,) = robot(tmp_path, "ray", ACROSS + UPWARDS, plugin).sensors
    assert isinstance(spec, MultiLayerLidarSpec)
    assert (spec.topic, spec.frame, spec.link, spec.rate_hz) == ("velodyne_points", "lens", "velodyne", 10.0)
    assert (spec.columns, spec.layers, spec.angle_min, spec.elevation_max) == (1875, 16, -3.1, 0.26)
    assert (spec.range_min, spec.range_max, spec.noise_stddev) == (0.9, 130.0, 0.008)
    assert (spec.groups, spec.period) == (10, 10_000_000)


def test_a_ray_sensor_that_is_read_out_as_a_cloud_is_one_though_it_is_flat(tmp_path: Path) -> None:
    output = "<output_type>sensor_msgs/PointCloud2</output_type>"
    plugin = f"<plugin filename='libgazebo_ros_ray_sensor.so'>{output}</plugin>"
    (spec,) = robot(tmp_path, "ray", ACROSS, plugin).sensors
    assert isinstance(spec, MultiLayerLidarSpec)
    assert (spec.layers, spec.elevation_min, spec.topic, spec.frame) == (1, 0.0, "points", None)


def test_gazebo_s_lidar_with_layers_makes_a_scan_and_a_cloud_below_it(tmp_path: Path) -> None:
    scan, cloud = robot(tmp_path, "gpu_lidar", ACROSS + UPWARDS, "<topic>front</topic>").sensors
    assert isinstance(scan, LidarSpec)
    assert isinstance(cloud, MultiLayerLidarSpec)
    assert (scan.topic, cloud.topic) == ("front", "front/points")
    assert (scan.name, cloud.name) == ("vlp", "vlp_points")
    assert (cloud.range_min, cloud.range_max, cloud.layers) == (0.3, 131.0, 16)


@pytest.mark.parametrize("rate", [1.0, 5.0, 20.0, 30.0, 29.97, 200.0, 1000.0])
def test_the_groups_of_a_turn_fill_it_whatever_the_rate(rate: float, tmp_path: Path) -> None:
    plugin = "<plugin filename='libgazebo_ros_velodyne_laser.so'/>"
    (spec,) = robot(tmp_path, "ray", ACROSS + UPWARDS, plugin, rate=rate).sensors
    assert isinstance(spec, MultiLayerLidarSpec)
    assert float(spec.period) * spec.groups == pytest.approx(1e9 / spec.rate_hz)
    assert float(spec.period) >= min(4e6, 1e9 / spec.rate_hz)


@pytest.mark.parametrize(
    ("scan", "said"),
    [
        (ACROSS + UPWARDS.replace("16", "1000000"), r"has 1875 x 1e\+06 samples; valid are whole numbers"),
        (ACROSS + UPWARDS.replace("16", "2.5"), r"has 1875 x 2.5 samples; valid are whole numbers"),
        (ACROSS + UPWARDS.replace("-0.26", "0.3"), r"min_angle is above max_angle"),
    ],
)
def test_layers_that_are_none_are_told(scan: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=said) as caught:
        robot(tmp_path, "gpu_lidar", scan)
    assert math.isfinite(caught.value.problems[0].line or math.nan)
