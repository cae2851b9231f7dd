"""What DiffDriveGoal shows, asks and pays for."""

import math

import numpy as np
import pytest

from twin.envs.diff_drive_goal import (
    DiffDriveGoalConfig,
    DiffDriveGoalEnv,
    DiffDriveGoalVectorEnv,
    Room,
)
from twin.envs.navigation import Reward
from twin.envs.randomisation import NONE, Episode
from twin.errors import GymError, SimulationError

EMPTY = DiffDriveGoalConfig(boxes=(), randomisation=NONE, reward=Reward(progress=2.0, step=-0.1))


@pytest.fixture(scope="module")
def empty():
    return DiffDriveGoalEnv(config=EMPTY)


def until_over(env, action, longest=200):
    rewards = []
    for _ in range(longest):
        observation, reward, terminated, truncated, info = env.step(np.array(action))
        rewards.append(reward)
        assert not truncated
        if terminated:
            return observation, rewards, info
    raise AssertionError("it is not over")


def test_goal_and_walls_are_seen_from_the_robot(empty):
    observation, info = empty.reset(
        seed=0, options={"start": (1.0, -1.0, math.pi / 2.0), "goal": (-1.0, 1.0)}
    )
    distance, cosine, sine, v, w, *rest = observation
    assert distance == pytest.approx(math.hypot(2.0, 2.0), abs=1e-5)
    assert info == {"distance": pytest.approx(distance, abs=1e-5)}
    assert math.degrees(math.atan2(sine, cosine)) == pytest.approx(45.0, abs=0.01)
    assert [v, w, *rest[:2]] == [0.0] * 4
    ranges = rest[2:]
    assert len(ranges) == 36
    # the lidar is 8 cm ahead of the base; ray k points 10 k - 180 degrees to the left of ahead
    for k, expected in ((18, 4.0 + 1.0 - 0.08), (0, 3.0 + 0.08), (27, 5.0), (9, 3.0)):
        assert ranges[k] == pytest.approx(expected, abs=0.06)  # six standard deviations of its noise


def test_the_goal_ends_an_episode_and_pays(empty):
    empty.reset(seed=0, options={"start": (0.0, 0.0, 0.0), "goal": (1.5, 0.0)})
    observation, rewards, info = until_over(empty, (1.0, 0.0))
    assert info["is_success"]
    assert not info["is_collision"]
    assert info["distance"] <= EMPTY.goal_tolerance
    assert observation[0] == pytest.approx(info["distance"], abs=0.02)
    assert sum(rewards) == pytest.approx(2.0 * (1.5 - info["distance"]) - 0.1 * len(rewards) + 5.0)
    assert max(rewards) == rewards[-1] > 5.0


def test_a_collision_ends_an_episode_and_costs(empty):
    empty.reset(seed=0, options={"start": (3.0, 0.0, 0.0), "goal": (-2.0, 0.0)})
    _, rewards, info = until_over(empty, (1.0, 0.0))
    assert info["is_collision"]
    assert not info["is_success"]
    assert rewards[-1] < -5.0
    assert info["distance"] == pytest.approx(5.0 + 4.0 - 0.2 - 3.0, abs=0.05)  # its nose is at the wall


def test_each_scan_has_noise_of_its_own(empty):
    scans = [empty.reset(seed=0)[0][7:], *(empty.step(np.zeros(2))[0][7:] for _ in range(30))]
    deviations = np.std(scans[1:], axis=0)
    assert np.median(deviations) == pytest.approx(0.01, rel=0.25)
    assert (np.diff(scans, axis=0) != 0.0).mean() > 0.99


def test_it_feels_its_speed_and_remembers_what_it_did(empty):
    empty.reset(seed=0, options={"start": (0.0, 0.0, 0.0), "goal": (0.0, 3.0)})
    for _ in range(15):
        observation, *_ = empty.step(np.array([0.3, 0.2]))
    assert observation[3] == pytest.approx(0.3, abs=0.02)
    assert observation[4] == pytest.approx(0.6, abs=0.05)
    np.testing.assert_allclose(observation[5:7], (0.3, 0.2), rtol=1e-6)


def test_every_layout_leaves_room_to_drive():
    config = DiffDriveGoalConfig()
    room = Room(config)
    radii = [math.hypot(*size) / 2.0 for size in config.boxes]
    missing = 0
    for seed in range(200):
        layout = room.layout(Episode(seed, 0))
        assert math.dist(layout.start[:2], layout.goal) >= config.least_distance
        missing += sum(pose is None for pose in layout.placed)
        round_things = [(layout.start[:2], 0.0), (layout.goal, 0.0)]
        round_things += [
            (pose[:2], radius) for pose, radius in zip(layout.placed, radii, strict=True) if pose is not None
        ]
        for i, (place, radius) in enumerate(round_things):
            assert max(map(abs, place)) <= 4.0 - config.gap - radius + 1e-9
            for other, other_radius in round_things[:i]:
                if i > 1:
                    assert math.dist(place, other) >= radius + other_radius + config.gap - 1e-9
    assert missing < 0.05 * 200 * len(radii)


def test_rates_must_fit():
    with pytest.raises(GymError, match=r"decision_period is 0.07 s, no whole number of times control_period"):
        DiffDriveGoalConfig(decision_period=0.07)
    with pytest.raises(GymError, match="beams is 7; valid: a number that divides the lidar's 360 rays"):
        DiffDriveGoalEnv(config=DiffDriveGoalConfig(beams=7))
    with pytest.raises(GymError, match="robot 'r2d2' has no"):
        DiffDriveGoalEnv(config=DiffDriveGoalConfig(robot="r2d2"))


def test_a_room_must_have_room():
    with pytest.raises(
        GymError, match=r"a room of 2 m x 2 m has no start and goal 2 m apart.*valid: a larger"
    ):
        DiffDriveGoalConfig(room=(2.0, 2.0))
    tight = DiffDriveGoalConfig(room=(3.2, 2.6), boxes=((2.0, 2.0), (0.2, 0.2)))
    for seed in range(20):
        layout = Room(tight).layout(Episode(seed, 0))
        assert math.dist(layout.start[:2], layout.goal) >= 2.0
        assert layout.placed[0] is None


def test_there_is_one_environment_at_least():
    with pytest.raises(GymError, match="num_envs is 0; valid: 1 or more"):
        DiffDriveGoalVectorEnv(0, config=EMPTY)
    with pytest.raises(GymError, match="threads is -1; valid: 0 or more"):
        DiffDriveGoalVectorEnv(1, config=EMPTY, threads=-1)


def test_physics_that_diverges_is_told(empty):
    empty.reset(seed=0)
    empty.navigation.simulations.qvel[0, 0] = np.nan
    with pytest.raises(SimulationError, match="the physics of environment 0 diverged; reset it"):
        empty.step(np.zeros(2))
    empty.reset(seed=0)
    empty.step(np.zeros(2))
