"""Environments keep gymnasium's contract, and are the same alone, among many and on any number of threads."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from twin.errors import GymError, TwinError

IDS = ("twin.envs:twin/DiffDriveGoal-v0", "twin.envs:twin/WarehouseNav-v0")
STEPS = 45


@pytest.fixture(scope="module", params=IDS)
def env_id(request):
    return request.param


@pytest.fixture(scope="module")
def env(env_id):
    made = gym.make(env_id)
    yield made
    made.close()


@pytest.fixture(scope="module")
def vector(env_id):
    made = gym.make_vec(env_id, num_envs=4, threads=1, max_episode_steps=30)
    yield made
    made.close()


def actions(steps, count, seed=0):
    """Half of them drive straight on until they hit something."""
    found = np.random.default_rng(seed).uniform(-1.0, 1.0, (steps, count, 2)).astype(np.float32)
    found[:, ::2] = (1.0, 0.0)
    return found


def drive(vector, seed, steps=STEPS):
    taken = [vector.reset(seed=seed)]
    taken += [vector.step(action) for action in actions(steps, vector.num_envs)]
    return taken


def test_check_env_has_nothing_to_say(env):
    check_env(env.unwrapped, skip_render_check=True)


def test_the_vector_is_the_same_on_two_threads(env_id, vector):
    other = gym.make_vec(env_id, num_envs=4, threads=2, max_episode_steps=30)
    for one, two in zip(drive(vector, 7), drive(other, 7), strict=True):
        for left, right in zip(one[:-1], two[:-1], strict=True):
            np.testing.assert_array_equal(left, right)
    other.close()


@pytest.mark.parametrize("i", [0, 3])
def test_an_environment_is_the_same_alone(env_id, vector, i):
    alone = gym.make(env_id, max_episode_steps=30)
    observation, _ = alone.reset(seed=7 + i)
    many = drive(vector, 7)
    np.testing.assert_array_equal(observation, many[0][0][i])
    ends = 0
    for action, (observations, rewards, terminated, truncated, info) in zip(
        actions(STEPS, 4), many[1:], strict=True
    ):
        observation, *others, last = alone.step(action[i])
        assert others == [rewards[i], terminated[i], truncated[i]]
        if terminated[i] or truncated[i]:
            ends += 1
            np.testing.assert_array_equal(observation, info["final_obs"][i])
            assert last == {name: info["final_info"][name][i] for name in last}
            observation, _ = alone.reset()
        np.testing.assert_array_equal(observation, observations[i])
    assert ends
    alone.close()


@pytest.mark.parametrize("action", [[0.0], [0.0, 0.0, 0.0], [np.nan, 0.0], [0.0, np.inf], ["a", "b"]])
def test_a_wrong_action_is_told_in_one_sentence(env, vector, action):
    env.reset(seed=0)
    vector.reset(seed=0)
    for wrong, made in ((action, env), ([action] * 4, vector)):
        with pytest.raises(GymError, match=r"^action .*valid: .*\[-1, 1\]$") as caught:
            made.step(np.array(wrong))
        assert isinstance(caught.value, TwinError)
        assert isinstance(caught.value, ValueError)
