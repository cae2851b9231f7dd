"""Sensors against what geometry and mechanics say they must read."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.sim.conftest import BUMPER, IMU, LIDAR, SONAR, box, placed
from twin.errors import ModelError
from twin.geometry import Pose2, Pose3, rotate_wxyz
from twin.models.shapes import Box
from twin.models.specs import SensorSpec
from twin.sim.scene import FreeBody, Scene, Shape
from twin.sim.world import World


def sample(
    scene: Scene, spec: SensorSpec, pose: Pose2 | Pose3, base: str = "kinematic", seed: int = 0
) -> Any:
    """The first reading of one sensor on a cart that stands still."""
    world = World.compose(scene, [placed(pose, base, sensors=(spec,))], seed=seed)
    (sensor,) = world.robots["cart"].sensors
    return sensor.sample(world.time_ns)


NOISY = replace(LIDAR, noise_stddev=0.02, samples=2000, angle_min=-1.0, angle_max=1.0)


def walls_at(pose: Pose2, angles: np.ndarray) -> np.ndarray:
    """Distance from a point to the walls x = ±3, y = ±2 along each angle of its own frame."""
    with np.errstate(divide="ignore"):
        c, s = np.cos(angles + pose.yaw), np.sin(angles + pose.yaw)
        along_x = np.where(c > 0, 3.0 - pose.x, -3.0 - pose.x) / c
        along_y = np.where(s > 0, 2.0 - pose.y, -2.0 - pose.y) / s
    return np.minimum(np.abs(along_x), np.abs(along_y))


def test_lidar_measures_walls_exactly(room: Scene) -> None:
    cart = Pose2(0.4, -0.3, 0.7)
    reading = sample(room, LIDAR, cart)
    angles = np.linspace(LIDAR.angle_min, LIDAR.angle_max, LIDAR.samples)
    expected = walls_at(cart @ Pose2(0.05, 0.0, 0.0), angles)
    np.testing.assert_allclose(reading.ranges, expected, atol=1e-6)


def test_lidar_sees_where_the_robot_is_now_not_a_substep_ago(room: Scene) -> None:
    world = World.compose(room, [placed(sensors=(LIDAR,))])
    hardware = world.robots["cart"].hardware
    for joint in hardware.commanded_joints[:2]:
        hardware.command(joint, 12.0)
    hardware.apply()
    world.step(300)
    (lidar,) = world.robots["cart"].sensors
    ahead = lidar.sample(world.time_ns).ranges[LIDAR.samples // 2]
    # The state itself, not what MuJoCo derives from it a substep later.
    start = world.model.jnt_qposadr[world.model.body("cart/base_link").jntadr[0]]
    base = world.data.qpos[start : start + 7]
    laser = Pose3(base[:3].copy(), base[3:].copy()) @ Pose3.from_xyz_rpy((0.05, 0.0, 0.13))
    forward = rotate_wxyz(laser.quat_wxyz, (1.0, 0.0, 0.0))
    assert ahead == pytest.approx((3.0 - laser.xyz[0]) / forward[0], abs=1e-9)
    np.testing.assert_allclose(world.pose("cart/laser").xyz, laser.xyz, atol=1e-12)


def test_lidar_gates_its_range(room: Scene) -> None:
    short = replace(LIDAR, range_max=2.5, range_min=1.0)
    reading = sample(room, short, Pose2(0.0, -1.5, 0.0))
    angles = np.linspace(LIDAR.angle_min, LIDAR.angle_max, LIDAR.samples)
    truth = walls_at(Pose2(0.05, -1.5, 0.0), angles)
    assert np.all(reading.ranges[truth > 2.5] == np.inf)
    assert np.all(reading.ranges[truth < 1.0] == -np.inf)
    assert (truth > 2.5).any()
    assert (truth < 1.0).any()


def test_lidar_noise_has_the_stated_spread(room: Scene) -> None:
    noisy = replace(LIDAR, noise_stddev=0.02, samples=2000)
    pose = Pose2(0.4, -0.3, 0.7)
    error = sample(room, noisy, pose).ranges - sample(room, replace(noisy, noise_stddev=0.0), pose).ranges
    assert np.std(error) == pytest.approx(0.02, rel=0.1)
    assert abs(np.mean(error)) < 0.002
    np.testing.assert_array_equal(
        sample(room, noisy, pose, seed=1).ranges, sample(room, noisy, pose, seed=1).ranges
    )
    assert not np.array_equal(sample(room, noisy, pose).ranges, sample(room, noisy, pose, seed=1).ranges)


def test_the_noise_of_every_scan_is_another(room: Scene) -> None:
    world = World.compose(room, [placed(Pose2(0.4, -0.3, 0.7), "kinematic", sensors=(NOISY,))])
    (lidar,) = world.robots["cart"].sensors
    truth = walls_at(Pose2(0.4, -0.3, 0.7) @ Pose2(0.05, 0.0, 0.0), np.linspace(-1.0, 1.0, 2000))
    errors = []
    for _ in range(3):
        errors.append(lidar.sample(world.time_ns).ranges - truth)
        world.step(50)
    correlation = np.corrcoef(errors)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 0.1


def test_lidar_sees_collision_shapes_of_other_robots_not_their_visuals(room: Scene) -> None:
    other = replace(placed(Pose2(1.05, 0.0, 0.0), sensors=()), name="other")
    beam = replace(LIDAR, samples=1, angle_min=0.0)
    lidar = placed(Pose3.from_xyz_rpy((0.0, 0.0, -0.01)), "kinematic", sensors=(beam,))
    world = World.compose(room, [lidar, other], visuals=True)
    # At z = 0.12 the other cart has its visual hull from x = 0.90 on, and its mast from x = 0.93 on.
    ahead = world.robots["cart"].sensors[0].sample(0).ranges[0]
    assert ahead == pytest.approx(0.93 - 0.05, abs=1e-6)


def test_lidar_sees_all_of_a_body_whose_centre_of_mass_is_far_from_its_middle() -> None:
    """MuJoCo's own culling of many rays loses the light end of such a body when the body is turned."""
    block = Shape(geometry=Box(size=(0.6, 0.6, 0.6)), T_body_geometry=Pose3.from_xyz_rpy((-0.6, 0.0, 0.0)))
    post = Shape(geometry=Box(size=(0.04, 0.04, 0.6)), T_body_geometry=Pose3.from_xyz_rpy((0.6, 0.0, 0.0)))
    turned = Pose3.from_xyz_rpy((2.0, 0.0, 0.3), (0.0, 0.0, math.pi))
    crane = FreeBody(name="crane", T_world_body=turned, mass=30.0, friction=0.6, shapes=(block, post))
    beam = replace(LIDAR, samples=1, angle_min=0.0)
    reading = sample(Scene(name="yard", goods=(crane,)), beam, Pose2(1.4, -2.0, math.pi / 2.0))
    assert reading.ranges[0] == pytest.approx(2.0 - 0.02 - 0.05, abs=1e-6)


def test_imu_at_rest_feels_gravity_upwards(room: Scene) -> None:
    world = World.compose(room, [placed(sensors=(IMU,))])
    world.step(1000)
    reading = world.robots["cart"].sensors[0].sample(world.time_ns)
    np.testing.assert_allclose(np.linalg.norm(reading.linear_acceleration), 9.81, atol=0.01)
    assert reading.linear_acceleration[2] == pytest.approx(9.81, abs=0.01)
    np.testing.assert_allclose(reading.angular_velocity, 0.0, atol=1e-3)


def test_imu_in_free_fall_feels_nothing(room: Scene) -> None:
    world = World.compose(room, [placed(Pose3.from_xyz_rpy((0, 0, 3.0)), sensors=(IMU,))])
    world.step(50)
    reading = world.robots["cart"].sensors[0].sample(world.time_ns)
    np.testing.assert_allclose(reading.linear_acceleration, 0.0, atol=1e-6)


def test_imu_in_a_steady_turn_feels_turn_rate_and_centripetal_force(room: Scene) -> None:
    world = World.compose(room, [placed(sensors=(IMU,))])
    hardware = world.robots["cart"].hardware
    hardware.command("left_wheel_joint", 4.0)
    hardware.command("right_wheel_joint", 10.0)
    hardware.apply()
    world.step(1000)
    gyro, force = np.zeros(3), np.zeros(3)
    for _ in range(1000):
        world.step(1)
        reading = world.robots["cart"].sensors[0].sample(world.time_ns)
        heading = Pose3.from_pose2(world.pose("cart/imu").to_pose2())
        upright = heading.inverse() @ world.pose("cart/imu")  # roll and pitch alone
        gyro += rotate_wxyz(upright.quat_wxyz, reading.angular_velocity) / 1000
        force += rotate_wxyz(upright.quat_wxyz, reading.linear_acceleration) / 1000
    # v = r (wl + wr) / 2, omega = r (wr - wl) / track; the IMU is 0.1 m ahead of the axle.
    v, omega = 0.05 * 7.0, 0.05 * 6.0 / 0.30
    assert gyro[2] == pytest.approx(omega, rel=0.02)
    assert force[1] == pytest.approx(v * omega, rel=0.05)
    assert force[0] == pytest.approx(-(omega**2) * 0.1, abs=0.02)
    assert force[2] == pytest.approx(9.81, abs=0.02)


def test_gyro_bias_is_constant_in_a_run_and_drawn_for_each_seed(room: Scene) -> None:
    biased = replace(IMU, gyro_bias_stddev=0.01)
    first = sample(room, biased, Pose2(0, 0, 0)).angular_velocity
    world = World.compose(room, [placed(base="kinematic", sensors=(biased,))])
    world.step(100)
    np.testing.assert_allclose(world.robots["cart"].sensors[0].sample(world.time_ns).angular_velocity, first)
    assert np.all(first != 0.0)
    assert np.all(sample(room, biased, Pose2(0, 0, 0), seed=1).angular_velocity != first)


@pytest.mark.parametrize("angle", [0.0, 12.0, -12.0])
def test_range_finds_a_thin_post_anywhere_in_its_cone(angle: float) -> None:
    direction = math.radians(angle)
    post = box("post", (0.05 + 2.0 * math.cos(direction), 2.0 * math.sin(direction), 0.5), (0.2, 0.2, 1.0))
    reading = sample(Scene(name="post", statics=(post,)), SONAR, Pose2(0.0, 0.0, 0.0))
    assert reading.range == pytest.approx(1.9, abs=0.05)


def test_range_misses_what_is_outside_of_its_cone_and_ignores_the_floor() -> None:
    post = box("post", (1.05, 1.0, 0.5), (0.2, 0.2, 1.0))
    assert sample(Scene(name="post", statics=(post,)), SONAR, Pose2(0, 0, 0)).range == math.inf


def test_range_looks_up_and_down_too() -> None:
    lintel = box("lintel", (1.05, 0.0, 0.48), (0.2, 2.0, 0.2))
    reading = sample(Scene(name="lintel", statics=(lintel,)), SONAR, Pose2(0, 0, 0))
    assert reading.range == pytest.approx(math.hypot(0.9, 0.2), abs=0.05)


def test_range_too_near_is_minus_infinity() -> None:
    wall = box("wall", (1.05, 0.0, 0.5), (0.2, 4.0, 1.0))
    reading = sample(Scene(name="wall", statics=(wall,)), replace(SONAR, range_min=1.0), Pose2(0, 0, 0))
    assert reading.range == -math.inf


def test_bumper_feels_a_wall_but_not_the_floor(room: Scene) -> None:
    world = World.compose(room, [placed(Pose2(2.7, 0.0, 0.0), sensors=(BUMPER,))])
    (bumper,) = world.robots["cart"].sensors
    world.step(100)
    assert bumper.sample(world.time_ns).touched == ()
    hardware = world.robots["cart"].hardware
    for joint in hardware.commanded_joints[:2]:
        hardware.command(joint, 6.0)
    hardware.apply()
    world.step(500)
    reading = bumper.sample(world.time_ns)
    assert reading.touched == ("wall_east",)
    assert reading.force_N > 1.0


def test_no_sensor_is_faster_than_the_physics(room: Scene) -> None:
    World.compose(room, [placed(sensors=(replace(IMU, rate_hz=500.0), replace(BUMPER, rate_hz=499.0)))])
    with pytest.raises(ModelError) as caught:
        World.compose(room, [placed(sensors=(replace(IMU, rate_hz=1000.0, line=7),))])
    assert str(caught.value).endswith(
        ":7: sensor 'imu' of robot 'cart' samples at 1000 Hz, faster than the physics steps; "
        "valid is at most 500 Hz, or a physics.timestep of at most 1 ms instead of 2 ms"
    )
