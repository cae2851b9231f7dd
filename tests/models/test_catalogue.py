"""The robots that ship with twin are what their descriptions promise."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

from twin.errors import ModelError
from twin.geometry import matrix_from_quat_wxyz
from twin.models import catalogue, link_poses, load
from twin.models.description import RobotDescription
from twin.models.kinematics import joint_positions
from twin.runtime.defaults.from_description import footprint
from twin.sensors.contact import ContactSpec
from twin.sensors.imu import ImuSpec
from twin.sensors.lidar import LidarSpec
from twin.sensors.range import RangeSpec

ROBOTS = ("diff_bot", "jackal", "r2d2", "sp1s", "test_robot", "warehouse_bot")


def random_positions(description: RobotDescription, seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    positions = {}
    for name, joint in description.joints.items():
        if joint.type == "fixed" or joint.mimic is not None:
            continue
        low, high = joint.limit.lower, joint.limit.upper
        positions[name] = float(
            rng.uniform(-math.pi if low is None else low, math.pi if high is None else high)
        )
    return positions


def test_catalogue_is_these_robots() -> None:
    assert tuple(catalogue()) == ROBOTS


def test_unknown_robot_names_the_nearest() -> None:
    with pytest.raises(ModelError, match="unknown robot 'warehose_bot': did you mean 'warehouse_bot'"):
        load("warehose_bot")


def test_missing_file_is_not_taken_for_a_name() -> None:
    with pytest.raises(ModelError, match=r"no such model file: somewhere/robot\.urdf"):
        load("somewhere/robot.urdf")


@pytest.mark.parametrize("robot", ROBOTS)
def test_forward_kinematics_equals_yourdfpy(robot: str) -> None:
    import yourdfpy

    description = load(robot)
    oracle = yourdfpy.URDF.load(
        io.BytesIO(description.urdf.encode()), load_meshes=False, build_collision_scene_graph=False
    )
    for seed in range(5):
        positions = random_positions(description, seed)
        every = joint_positions(description, positions)
        oracle.update_cfg({name: float(every[name][0]) for name in oracle.actuated_joint_names})
        for link, pose in link_poses(description, positions).items():
            expected = oracle.get_transform(link, description.root)
            np.testing.assert_allclose(pose.xyz, expected[:3, 3], atol=1e-9)
            np.testing.assert_allclose(matrix_from_quat_wxyz(pose.quat_wxyz), expected[:3, :3], atol=1e-9)


@pytest.mark.parametrize("robot", ROBOTS)
def test_masses_and_inertias_equal_yourdfpy(robot: str) -> None:
    import yourdfpy

    description = load(robot)
    oracle = yourdfpy.URDF.load(
        io.BytesIO(description.urdf.encode()), load_meshes=False, build_scene_graph=False
    )
    assert set(oracle.link_map) == set(description.links)
    for name, link in description.links.items():
        expected = oracle.link_map[name].inertial
        if link.inertial is None:
            assert expected is None or expected.mass in (None, 0.0)
            continue
        assert link.inertial.mass == expected.mass
        np.testing.assert_array_equal(link.inertial.inertia, expected.inertia)


def test_warehouse_bot_reaches_what_its_header_says() -> None:
    bot = load("warehouse_bot")

    def grasp(**positions: float) -> np.ndarray:
        return link_poses(bot, positions)["grasp_frame"].xyz

    np.testing.assert_allclose(grasp(), (0.20, 0.0, 0.42), atol=1e-9)
    np.testing.assert_allclose(grasp(arm_stage_1_joint=0.32), (0.84, 0.0, 0.42), atol=1e-9)
    np.testing.assert_allclose(grasp(lift_joint=1.05), (0.20, 0.0, 1.47), atol=1e-9)
    np.testing.assert_allclose(grasp(wrist_yaw_joint=math.pi / 2), (0.015, 0.185, 0.42), atol=1e-9)
    assert bot.drive is not None
    assert bot.drive.kind == "diff_drive"
    assert bot.drive.wheel_separation == 0.5
    assert set(bot.commands) == {"lift_joint", "arm_stage_1_joint", "wrist_yaw_joint", "left_finger_joint"}


def test_sensors_of_warehouse_bot() -> None:
    scan, palm, imu, bumper = load("warehouse_bot").sensors
    assert isinstance(scan, LidarSpec)
    assert (scan.topic, scan.link, scan.samples, scan.rate_hz) == ("scan", "lidar_link", 360, 10.0)
    assert math.degrees(scan.angle_max) == pytest.approx(135.0)
    assert (scan.range_min, scan.range_max, scan.noise_stddev) == (0.05, 20.0, 0.01)
    assert isinstance(palm, LidarSpec)
    assert (palm.topic, palm.link, palm.samples) == ("palm_scan", "palm_lidar_link", 121)
    assert isinstance(imu, ImuSpec)
    assert (imu.topic, imu.rate_hz) == ("imu", 50.0)
    assert isinstance(bumper, ContactSpec)
    assert (bumper.topic, bumper.link) == ("bumper", "base_link")


def test_sp1s_has_the_blogs_dimensions_and_a_cone_ahead() -> None:
    car = load("sp1s")
    poses = link_poses(car)
    for end, x in (("front", 0.085), ("back", -0.085)):
        for side, y in (("left", 0.0925), ("right", -0.0925)):
            assert car.joints[f"base_to_{end}_{side}"].child == f"tyer_{end}_{side}"
            np.testing.assert_allclose(poses[f"tyer_{end}_{side}"].xyz, (x, y, 0.034), atol=1e-9)
    assert poses["base_link"].xyz[2] == pytest.approx(0.045)
    assert poses["upper_deck"].xyz[2] == pytest.approx(0.078)
    assert car.drive is not None
    assert car.drive.kind == "skid_steer"
    (sonar,) = (sensor for sensor in car.sensors if isinstance(sensor, RangeSpec))
    assert math.degrees(sonar.field_of_view) == pytest.approx(15.0)
    assert (sonar.range_min, sonar.range_max) == (0.02, 4.0)
    turned = link_poses(car, {"head_servo_joint": math.pi / 2})["ultrasonic_link"]
    np.testing.assert_allclose(turned.apply((1.0, 0.0, 0.0)) - turned.xyz, (0.0, 1.0, 0.0), atol=1e-9)


def test_jackal_has_the_numbers_of_the_barn_challenge() -> None:
    robot = load("jackal")
    assert robot.mass == pytest.approx(17.0)
    assert robot.drive is not None
    assert robot.drive.kind == "skid_steer"
    assert (robot.drive.wheel_separation, robot.drive.wheel_radius) == (0.37559, 0.098)
    assert (robot.drive.max_linear_velocity, robot.drive.max_angular_velocity) == (2.0, 4.0)
    scan = next(sensor for sensor in robot.sensors if isinstance(sensor, LidarSpec))
    assert (scan.samples, scan.range_max, scan.noise_stddev) == (720, 30.0, 0.01)
    assert math.degrees(scan.angle_max - scan.angle_min) == pytest.approx(270.0)
    corners = footprint(robot, padding=0.0)
    np.testing.assert_allclose(np.ptp(corners, axis=0), (0.458, 0.41559), atol=1e-5)


def test_r2d2_has_the_tutorials_joints() -> None:
    robot = load("r2d2")
    kinds = {name: joint.type for name, joint in robot.joints.items() if joint.type != "fixed"}
    assert kinds == {"tilt": "revolute", "swivel": "continuous", "periscope": "prismatic"}
    assert len(robot.links) == 7
    periscope = robot.joints["periscope"].limit
    assert (periscope.lower, periscope.upper) == (0.0, 0.2)


def test_test_robot_has_the_texts_axes() -> None:
    joints = load("test_robot").joints
    np.testing.assert_allclose(joints["joint1"].axis, np.array([-1.0, 1.0, 0.0]) / math.sqrt(2.0))
    assert joints["joint2"].axis == (0.0, 1.0, 0.0)
    np.testing.assert_allclose(joints["joint2"].T_parent_joint.xyz, (-2.0, 5.0, 0.0))
