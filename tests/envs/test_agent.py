"""A node of a run gives a policy what the environment gave it."""

import math

import numpy as np
import pytest

from twin.bridge.msgs import header
from twin.envs.diff_drive_goal import DiffDriveGoalConfig, DiffDriveGoalEnv
from twin.envs.randomisation import NONE
from twin.geometry import Pose2
from twin.sensors.lidar import Lidar, LidarReading


@pytest.fixture(scope="module")
def env():
    return DiffDriveGoalEnv(config=DiffDriveGoalConfig(randomisation=NONE))


def test_messages_give_the_observation_of_the_environment(env):
    observation, _ = env.reset(seed=2, options={"start": (0.5, 0.2, 0.7), "goal": (-1.0, 2.0)})
    navigation = env.navigation
    spec, agent = navigation.simulations.robot.lidar, navigation.agent
    ranges = np.full(spec.samples, 1.0)  # of all rays; the observed ones are those of the environment
    ranges[::10] = observation[7:]
    ranges[::10][observation[7:] >= spec.range_max] = np.inf
    message = Lidar.to_message(spec, header(0, "lidar_link"), LidarReading(time_ns=0, ranges=ranges))
    goal_in_odom = Pose2(0.5, 0.2, 0.7).inverse().apply([(-1.0, 2.0)])
    found = agent.observe(
        np.zeros((1, 3)), goal_in_odom[None], np.zeros((1, 2)), np.zeros((1, 2)), agent.ranges(message)[None]
    )
    np.testing.assert_allclose(found[0], observation, atol=1e-5)
    assert agent.observation_space.contains(found[0])


def test_ranges_of_a_scan_that_says_nothing_are_bounded(env):
    agent, spec = env.navigation.agent, env.navigation.simulations.robot.lidar
    ranges = np.full(spec.samples, 3.0)
    ranges[[0, 10, 20, 30]] = np.inf, -np.inf, math.nan, spec.range_min / 2.0
    message = Lidar.to_message(spec, header(0, "lidar_link"), LidarReading(time_ns=0, ranges=ranges))
    np.testing.assert_allclose(agent.ranges(message)[:5], [spec.range_max, 0.0, spec.range_max, 0.0, 3.0])


def test_actions_are_shares_of_the_drive_s_limits(env):
    agent = env.navigation.agent
    np.testing.assert_allclose(agent.velocities([[1.0, -0.5], [-3.0, 0.0]]), [[1.0, -1.5], [-1.0, 0.0]])
