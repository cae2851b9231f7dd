"""Drives and sensors in the spellings of classic and new Gazebo."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models.loader import parse_urdf
from twin.models.specs import DriveSpec
from twin.sensors.lidar import LidarSpec
from twin.sensors.range import RangeSpec

WHEELS = ("fl", "fr", "bl", "br")


def robot(*lines: str) -> str:
    links = "".join(f"<link name='{name}'/>" for name in WHEELS)
    joints = "".join(
        f"<joint name='{name}_joint' type='continuous'><parent link='base'/><child link='{name}'/>"
        "<axis xyz='0 1 0'/><limit effort='3' velocity='9'/></joint>"
        for name in WHEELS
    )
    return f"<robot name='r'><link name='base'/>{links}{joints}{''.join(lines)}</robot>"


def drive_of(plugin: str) -> DriveSpec:
    drive = parse_urdf(robot(f"<gazebo>{plugin}</gazebo>"), Path("r.urdf")).drive
    assert drive is not None
    return drive


PLUGINS = {
    "gz": "<plugin filename='gz-sim-diff-drive-system' name='gz::sim::systems::DiffDrive'>"
    "<left_joint>fl_joint</left_joint><right_joint>fr_joint</right_joint>"
    "<wheel_separation>0.4</wheel_separation><wheel_radius>0.05</wheel_radius></plugin>",
    "ignition": "<plugin filename='libignition-gazebo-diff-drive-system.so'>"
    "<left_joint>fl_joint</left_joint><right_joint>fr_joint</right_joint>"
    "<wheel_separation>0.4</wheel_separation><wheel_radius>0.05</wheel_radius></plugin>",
    "classic ROS 2": "<plugin filename='libgazebo_ros_diff_drive.so' name='d'>"
    "<left_joint>fl_joint</left_joint><right_joint>fr_joint</right_joint>"
    "<wheel_separation>0.4</wheel_separation><wheel_diameter>0.1</wheel_diameter></plugin>",
    "classic ROS 1": "<plugin filename='libgazebo_ros_diff_drive.so' name='d'>"
    "<leftJoint>fl_joint</leftJoint><rightJoint>fr_joint</rightJoint>"
    "<wheelSeparation>0.4</wheelSeparation><wheelDiameter>0.1</wheelDiameter></plugin>",
}


@pytest.mark.parametrize("name", PLUGINS)
def test_diff_drive_in_every_spelling(name: str) -> None:
    drive = drive_of(PLUGINS[name])
    assert drive.kind == "diff_drive"
    assert (drive.left_joints, drive.right_joints) == (("fl_joint",), ("fr_joint",))
    assert (drive.wheel_separation, drive.wheel_radius) == (0.4, 0.05)
    assert drive.max_wheel_torque == 3.0, (
        "the joint's effort stands in for a torque that the plugin does not give"
    )


def test_a_torque_is_a_magnitude() -> None:
    plugin = PLUGINS["classic ROS 2"].replace("</plugin>", "<torque>{}</torque></plugin>")
    assert drive_of(plugin.format(0)).max_wheel_torque == 0.0
    with pytest.raises(ModelError, match="wheel torque -1 Nm; give a magnitude"):
        drive_of(plugin.format(-1))


def test_skid_steer() -> None:
    drive = drive_of(
        "<plugin filename='libgazebo_ros_skid_steer_drive.so'><leftFrontJoint>fl_joint</leftFrontJoint>"
        "<rightFrontJoint>fr_joint</rightFrontJoint><leftRearJoint>bl_joint</leftRearJoint>"
        "<rightRearJoint>br_joint</rightRearJoint><wheelSeparation>0.4</wheelSeparation>"
        "<wheelDiameter>0.1</wheelDiameter><torque>7</torque><robotBaseFrame>base</robotBaseFrame></plugin>"
    )
    assert drive.kind == "skid_steer"
    assert drive.left_joints == ("fl_joint", "bl_joint")
    assert (drive.max_wheel_torque, drive.base_frame) == (7.0, "base")


RAY = (
    "<scan><horizontal><samples>5</samples>"
    "<min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan>"
    "<range><min>0.1</min><max>8</max></range>"
)


@pytest.mark.parametrize(
    ("kind", "element"), [("ray", "ray"), ("gpu_ray", "ray"), ("gpu_lidar", "lidar"), ("lidar", "lidar")]
)
def test_lidar_in_every_spelling(kind: str, element: str) -> None:
    sensor = (
        f"<sensor name='s' type='{kind}'><update_rate>7</update_rate><{element}>{RAY}</{element}></sensor>"
    )
    text = robot(f"<gazebo reference='base'>{sensor}</gazebo>")
    (lidar,) = parse_urdf(text, Path("r.urdf")).sensors
    assert isinstance(lidar, LidarSpec)
    assert (lidar.topic, lidar.rate_hz, lidar.samples, lidar.angle_min) == ("scan", 7.0, 5, -1.0)


def test_topic_of_a_classic_plugin_and_ultrasonic_by_its_output_type() -> None:
    sensor = (
        f"<sensor name='s' type='ray'><ray>{RAY}</ray><plugin filename='libgazebo_ros_ray_sensor.so'>"
        "<ros><remapping>~/out:=front</remapping></ros><output_type>sensor_msgs/Range</output_type></plugin></sensor>"
    )
    (sonar,) = parse_urdf(robot(f"<gazebo reference='base'>{sensor}</gazebo>"), Path("r.urdf")).sensors
    assert isinstance(sonar, RangeSpec)
    assert (sonar.topic, sonar.field_of_view) == ("front", 2.0)
    assert math.isclose(sonar.range_max, 8.0)


def test_friction() -> None:
    text = robot("\n<gazebo reference='fl'><mu1>0.3</mu1></gazebo>")
    assert parse_urdf(text, Path("r.urdf")).links["fl"].surface.friction == 0.3
