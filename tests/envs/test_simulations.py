"""A robot of the environments does what the same robot does in a run, and differs as it is told to."""

import math

import numpy as np
import pytest

from twin.controllers.diff_drive import DiffDriveController
from twin.controllers.limiter import AxisLimits, SpeedLimiter
from twin.controllers.odometry import Odometry, OdometryConfig
from twin.convert import convert
from twin.envs import kernels
from twin.envs.randomisation import NONE, Episode, Randomisation
from twin.envs.robot import DrivenRobot
from twin.envs.simulations import Simulations
from twin.geometry import Pose2, Pose3, yaw_from_quat_wxyz
from twin.models import load
from twin.models.shapes import Box
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import PlacedBody, Scene, Shape, StaticBody
from twin.sim.world import World

PERIOD, STEP = 0.02, 0.004
BLOCK = (Shape(geometry=Box(size=(0.4, 0.6, 0.5))),)
WALLS = Scene(
    name="walls",
    statics=(StaticBody(name="wall", T_world_body=Pose3.from_xyz_rpy((2.0, 0.0, 0.25)), shapes=BLOCK),),
    placed=(PlacedBody(name="box", T_world_body=Pose3.from_xyz_rpy((0.0, -1.0, 0.25)), shapes=BLOCK),),
)


def simulations(robot, scene, count=1, randomisation=NONE, beams=36):
    made = Simulations(
        DrivenRobot(robot, timestep=STEP),
        scene,
        count,
        control_period=PERIOD,
        beams=beams,
        randomisation=randomisation,
        threads=1,
    )
    for i in range(count):
        made.begin(i, Episode(i, 0), Pose2(0.0, 0.0, 0.3))
    return made


@pytest.fixture(scope="module", params=["diff_bot", "warehouse_bot"])
def pair(request):
    """The robot in the environments, and in a world with the nodes' classes around it; both have driven."""
    sims = simulations(request.param, WALLS)
    for state in sims.mocap_pos:
        state[0] = (0.0, -1.0, 0.25)
    conversion = convert(load(request.param), timestep=STEP)
    placement = RobotPlacement(name="robot", conversion=conversion, pose=Pose2(0.0, 0.0, 0.3))
    world = World.compose(WALLS, [placement], Physics(timestep=STEP), seed=3)
    hardware = world.robots["robot"].hardware
    spec = sims.robot.spec
    wheels = [hardware.joint_names.index(name) for name in (*spec.left_joints, *spec.right_joints)]
    sims.states.scale[0] = np.array(hardware._own_scale)[wheels]
    controller = DiffDriveController(sims.robot.drive)
    odometry = Odometry(OdometryConfig(wheel_radius=sims.robot.drive.wheel_radius, track=controller.track))
    for tick in range(75):
        command = (0.6, 0.8) if tick < 50 else (-2.0, -9.0)
        position = hardware.read().position[wheels]
        left, right = position[: len(spec.left_joints)].mean(), position[len(spec.left_joints) :].mean()
        odometry.update(left, right, PERIOD)
        controller.set_command(*command)
        speeds = controller.update(PERIOD)
        for name in spec.left_joints:
            hardware.command(name, speeds.left)
        for name in spec.right_joints:
            hardware.command(name, speeds.right)
        hardware.apply()
        world.step(5)
        sims.tick(np.array([command]))
    position = hardware.read().position[wheels]
    odometry.update(
        position[: len(spec.left_joints)].mean(), position[len(spec.left_joints) :].mean(), PERIOD
    )
    return sims, world, odometry


def test_it_drives_as_in_a_run(pair):
    sims, world, _ = pair
    pose = world.pose(world.robots["robot"].base)
    assert math.hypot(*pose.xyz[:2]) > 0.2
    np.testing.assert_allclose(sims.root[0, :3], pose.xyz, atol=1e-6)
    np.testing.assert_allclose(sims.root[0, 3:], pose.quat_wxyz, atol=1e-6)


def test_its_odometry_is_that_of_a_run(pair):
    sims, _, odometry = pair
    got = sims.states.odometry[0]
    np.testing.assert_allclose(got[:3], odometry.pose, atol=1e-6)
    np.testing.assert_allclose(got[3:], odometry.velocity, atol=1e-6)


def test_its_scan_is_that_of_a_run(pair):
    sims, world, _ = pair
    sensor = next(s for s in world.robots["robot"].sensors if s.spec.topic == "scan")
    every = sensor.spec.samples // 36
    reading = sensor._rays.cast()[::every]
    hits = sims.hits()[0]
    assert (hits > 0.0).sum() >= 3
    true = np.where(reading > sensor.spec.range_max, np.inf, reading)
    got = np.where((hits < 0.0) | (hits > sensor.spec.range_max), np.inf, hits)
    np.testing.assert_allclose(got, true, atol=1e-5)


def test_it_knows_when_the_robot_touches_something_as_a_run_does(pair):
    sims, world, _ = pair
    robot = world.robots["robot"]
    sims.root[0] = (1.3, 0.0, sims.robot.spawn_height, 1.0, 0.0, 0.0, 0.0)
    sims.qvel[0] = 0.0
    robot.carry(Pose3.from_xyz_rpy((1.3, 0.0, sims.robot.spawn_height)))
    spec = sims.robot.spec
    touched = []
    for _ in range(60):
        for name in (*spec.left_joints, *spec.right_joints):
            robot.hardware.command(name, 0.5 / sims.robot.drive.wheel_radius)
        robot.hardware.apply()
        world.step(5)
        touched.append((bool(sims.tick(np.array([[0.5, 0.0]]))[0]), bool(world.contacts())))
    first = [next(i for i, both in enumerate(touched) if both[k]) for k in (0, 1)]
    assert abs(first[0] - first[1]) <= 5  # the ramps of both differ
    assert not any(touched[0])
    assert touched[-1] == (True, True)


SPREAD = Randomisation(
    mass=0.3, friction=0.3, wheel_radius=0.04, wheel_mismatch=0.02, latency=(0.0, 0.1), lidar_noise=(0.0, 0.1)
)


@pytest.fixture(scope="module")
def spread():
    """Eight robots that differ."""
    return simulations("diff_bot", WALLS, 8, SPREAD)


def test_each_model_is_that_of_its_draw(spread):
    nominal = spread.model
    body = [i for i in range(nominal.nbody) if nominal.body(i).name.startswith("robot/")]
    wheels = spread.robot.wheels(nominal)
    for i in range(8):
        draw, model = Episode(i, 0).robot(SPREAD), spread.batch.get_model(i)
        assert model.body_mass[body].sum() == pytest.approx(draw.mass * nominal.body_mass[body].sum())
        assert model.body_subtreemass[body[0]] == pytest.approx(model.body_mass[body].sum())
        np.testing.assert_allclose(model.dof_M0[:3], nominal.dof_M0[:3] * draw.mass, rtol=1e-6)
        for k, factor in enumerate((draw.radius_left, draw.radius_right)):
            (tyre,) = np.flatnonzero((model.geom_bodyid == wheels.body[k]) & (model.geom_contype > 0))
            np.testing.assert_allclose(model.geom_size[tyre, :2], 0.05 * factor)
            assert model.geom_rbound[tyre] >= 0.05 * factor
            assert model.geom_friction[tyre, 0] == pytest.approx(0.9 * draw.friction)
            # the lowest point stays where it was
            low = model.body_pos[wheels.body[k], 2] - model.geom_size[tyre, 0]
            assert low == pytest.approx(nominal.body_pos[wheels.body[k], 2] - 0.05)
        assert spread.states.delay[i] == math.ceil(round(draw.latency / PERIOD, 6))
        assert spread.lidar_noise[i] == draw.lidar_noise


def test_larger_wheels_drive_farther_and_unequal_ones_turn(spread):
    for i in range(8):
        spread.begin(i, Episode(i, 0), Pose2(-30.0, 0.0, 0.0))
    for _ in range(200):
        spread.tick(np.full((8, 2), (0.5, 0.0)))
    draws = [Episode(i, 0).robot(SPREAD) for i in range(8)]
    mean = np.array([(draw.radius_left + draw.radius_right) / 2.0 for draw in draws])
    delay = spread.states.delay * PERIOD
    driven = np.hypot(spread.root[:, 0] + 30.0, spread.root[:, 1])
    ideal = mean * (4.0 * 0.5 - 0.5 * 0.5 / 2.0 - 0.5 * delay)  # a ramp of 1 m/s², and latency
    np.testing.assert_allclose(driven, ideal, rtol=0.006)
    yaw = [yaw_from_quat_wxyz(root[3:]) for root in spread.root]
    turned = [ideal[i] * (d.radius_right - d.radius_left) / 0.3 for i, d in enumerate(draws)]
    np.testing.assert_allclose(yaw, turned, rtol=0.08, atol=0.01)
    assert np.ptp(driven) > 0.05
    # who believes in wheels of equal size does not notice
    np.testing.assert_allclose(spread.states.odometry[:, 2], 0.0, atol=0.03)


def test_latency_shifts_what_a_robot_does():
    late = simulations("diff_bot", WALLS, 2, Randomisation(latency=(0.06, 0.06), mass=0.0))
    early = simulations("diff_bot", WALLS, 2, Randomisation(latency=(0.0, 0.0), mass=0.0))
    commands = np.random.default_rng(0).uniform(-1.0, 1.0, (30, 2, 2))
    before, after = [], []
    for command in commands:
        early.tick(command)
        late.tick(command)
        before.append(early.states.command.copy())
        after.append(late.states.command.copy())
    np.testing.assert_array_equal(before[:-3], after[3:])
    assert not np.array(after[:3]).any()


def test_noise_of_the_lidar_is_as_large_as_drawn(spread):
    hits = np.full((8, 36), 5.0)
    noise = np.random.default_rng(0).standard_normal((8, 36))
    ranges = spread.scan(hits, noise)
    np.testing.assert_allclose(ranges, 5.0 + spread.lidar_noise[:, None] * noise)


def test_ranges_have_bounds(spread):
    lidar = spread.robot.lidar
    hits = np.array([[-1.0, lidar.range_max + 0.1, lidar.range_min / 2.0, 1.0]] * 8)
    ranges = spread.scan(hits, np.zeros((8, 4)))
    np.testing.assert_array_equal(ranges, [[lidar.range_max, lidar.range_max, 0.0, 1.0]] * 8)


def test_one_wheel_at_a_wall_is_a_collision():
    sims = simulations("diff_bot", WALLS)
    beside = 1.8 - 0.16  # of the wall's face, and half of the width over the wheels
    for x, expected in ((beside - 0.004, False), (beside + 0.002, True)):
        sims.begin(0, Episode(0, 0), Pose2(x, 0.0, -math.pi / 2.0))
        assert bool(sims.tick(np.zeros((1, 2)))[0]) == expected


def test_speeds_are_limited_as_by_the_controller():
    limits = AxisLimits(max_velocity=1.0, max_acceleration=2.0, max_deceleration=5.0)
    limiter, axis = SpeedLimiter(limits), np.array([1.0, 2.0, 5.0])
    value = 0.0
    for target in np.random.default_rng(0).uniform(-1.5, 1.5, 300).repeat(3):
        value = kernels._limit(target, value, axis, PERIOD)
        assert value == pytest.approx(limiter.limit(target, PERIOD), abs=1e-12)
