"""A robot of the environments does what the same robot does in a run, and differs as it is told to."""

import math

import numpy as np
import pytest

from twin.controllers.diff_drive import DiffDriveController
from twin.controllers.odometry import Odometry, OdometryConfig
from twin.convert import convert
from twin.envs.randomisation import NONE, Episode
from twin.envs.robot import DrivenRobot
from twin.envs.simulations import Simulations
from twin.geometry import Pose2, Pose3
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
