"""Environments keep gymnasium's contract, and are the same alone, among many and on any number of threads."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from benchmarks.measures.memory import resident_mb
from twin.envs.gym_envs import NavigationEnv, NavigationVectorEnv
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


@pytest.mark.parametrize(
    ("action", "said"),
    [
        ([0.0], r"shape \((4, )?1,?\)"),
        ([0.0, 0.0, 0.0], r"shape \((4, )?3,?\)"),
        ([np.nan, 0.0], r"environment 0 is \[nan, 0.0\]"),
        ([0.0, np.inf], r"environment 0 is \[0.0, inf\]"),
        (["a", "b"], "type <U1"),
    ],
)
def test_a_wrong_action_is_told_in_one_sentence(env, vector, action, said):
    env.reset(seed=0)
    vector.reset(seed=0)
    for wrong, made in ((action, env), ([action] * 4, vector)):
        with pytest.raises(GymError, match=rf"^(the )?actions? .*{said}; valid: .*\[-1, 1\]$") as caught:
            made.step(np.array(wrong))
        assert isinstance(caught.value, TwinError)
        assert isinstance(caught.value, ValueError)
    made.step(np.zeros((4, 2)))  # nothing was done, and it goes on


def test_an_action_that_is_no_array_is_told_in_one_sentence(env, vector):
    env.reset(seed=0)
    vector.reset(seed=0)
    for made in (env, vector):
        with pytest.raises(GymError, match=r"^the action \[0.0, \[1.0, 2.0\]\] is no array; valid: "):
            made.unwrapped.step([0.0, [1.0, 2.0]])


def test_actions_beyond_the_space_count_as_its_bounds(env):
    ends = []
    for action in ((1.0, -1.0), (7.0, -3.0)):
        env.reset(seed=1)
        ends.append(env.step(np.array(action))[0])
    np.testing.assert_array_equal(ends[0][:5], ends[1][:5])


def test_a_step_needs_a_reset(env_id):
    for made, action in (
        (gym.make(env_id, disable_env_checker=True).unwrapped, np.zeros(2)),
        (gym.make_vec(env_id, num_envs=2), np.zeros((2, 2))),
    ):
        with pytest.raises(gym.error.ResetNeeded):
            made.step(action)
        made.close()


def test_a_seed_gives_the_same_first_observation_each_time(env_id, vector):
    resets = 1000 if "Goal" in env_id else 200  # the arena's lidar has more to see
    first, _ = vector.reset(seed=[0, 1, 2, 3])
    assert len({row.tobytes() for row in first}) == 4
    for _ in range(resets // 4):
        np.testing.assert_array_equal(vector.reset(seed=[0, 1, 2, 3])[0], first)


def test_without_a_seed_the_next_episode_follows(env, vector):
    alone = [env.reset(seed=5)[0], env.reset()[0], env.reset()[0]]
    many = [vector.reset(seed=[5, None, 6, 7])[0], vector.reset()[0], vector.reset()[0]]
    for one, some in zip(alone, many, strict=True):
        np.testing.assert_array_equal(one, some[0])
    assert len({row.tobytes() for row in alone}) == 3


def test_only_those_of_a_mask_begin_again(vector):
    vector.reset(seed=3)
    before, *_ = vector.step(np.full((4, 2), 0.5))
    mask = np.array([False, True, False, True])
    after, _ = vector.reset(seed=3, options={"reset_mask": mask})
    np.testing.assert_array_equal(after[~mask], before[~mask])
    fresh, _ = vector.reset(seed=3)
    np.testing.assert_array_equal(after[mask], fresh[mask])
    with pytest.raises(GymError, match=r"'reset_mask'.*valid: 4 booleans"):
        vector.reset(options={"reset_mask": [True] * 4})


def test_the_vector_truncates_by_itself(env_id):
    made = gym.make_vec(env_id, num_envs=2, max_episode_steps=3)
    made.reset(seed=0)
    seen = [made.step(np.zeros((2, 2)))[2:4] for _ in range(6)]
    assert [bool(truncated.all()) for _, truncated in seen] == [False, False, True] * 2
    assert not any(terminated.any() for terminated, _ in seen)
    made.close()
    with pytest.raises(GymError, match="max_episode_steps is 0; valid"):
        gym.make_vec(env_id, num_envs=2, max_episode_steps=0)


def test_in_the_next_step_as_within_the_same_only_later(vector):
    """Each episode has the same observations, whenever it begins."""
    later = NavigationVectorEnv(vector.unwrapped.navigation, 3, autoreset_mode="NextStep")
    taken = [later.reset(seed=1)[0]]
    ends = []
    for step in range(8):
        observations, rewards, _, truncated, info = later.step(np.full((4, 2), 0.3))
        taken.append(observations)
        ends.append(bool(truncated.all()))
        assert "final_obs" not in info
        if step in (3, 7):
            assert not rewards.any()
    assert ends == [False, False, True, False] * 2
    now = NavigationVectorEnv(vector.unwrapped.navigation, 3)
    expected = [now.reset(seed=1)[0]]
    for _ in range(6):
        observations, *_, info = now.step(np.full((4, 2), 0.3))
        if "final_obs" in info:
            expected.append(np.stack(list(info["final_obs"])))
        expected.append(observations)
    np.testing.assert_array_equal(taken, expected)


def test_where_it_is_disabled_the_user_resets(vector):
    made = NavigationVectorEnv(
        vector.unwrapped.navigation, 2, autoreset_mode=gym.vector.AutoresetMode.DISABLED
    )
    made.reset(seed=1)
    for _ in range(2):
        *_, truncated, _ = made.step(np.zeros((4, 2)))
    assert truncated.all()
    with pytest.raises(GymError, match="environment 0 is over; valid: reset it"):
        made.step(np.zeros((4, 2)))
    made.reset(options={"reset_mask": truncated})
    made.step(np.zeros((4, 2)))
    with pytest.raises(GymError, match="autoreset_mode is 'never'; valid: NextStep, SameStep, Disabled"):
        NavigationVectorEnv(vector.unwrapped.navigation, 2, autoreset_mode="never")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"goals": (0, 0)}, "unknown option 'goals' of reset; did you mean 'goal'"),
        ({"goal": (0.0, np.nan)}, r"option 'goal' of reset is .*valid: x \[m\], y \[m\]"),
        ({"start": (0.0, 1.0)}, r"option 'start' of reset is .*yaw \[rad\]"),
        ({"start": "there"}, r"option 'start' of reset is 'there'; valid"),
    ],
)
def test_a_wrong_option_is_told_in_one_sentence(env, options, said):
    with pytest.raises(GymError, match=said):
        env.reset(options=options)


def test_an_unknown_render_mode_is_told_in_one_sentence(env, vector):
    with pytest.raises(GymError, match="render_mode is 'ansi'; valid: human, rgb_array, or None"):
        NavigationEnv(env.unwrapped.navigation, "ansi")
    with pytest.raises(GymError, match="render_mode is 'human'; valid: rgb_array, or None"):
        NavigationVectorEnv(vector.unwrapped.navigation, None, "human")


def test_seeds_are_one_for_each(vector):
    with pytest.raises(GymError, match="2 seeds for 4 environments"):
        vector.reset(seed=[1, 2])
    for seed, said in ([1, 2, -1, 0], "-1"), ([0, 1.5, 2, 3], r"1\.5"), (0.5, r"0\.5"), ("abcd", "'a(bcd)?'"):
        with pytest.raises(GymError, match=f"seed {said}; valid: a whole number from 0 on"):
            vector.reset(seed=seed)


def test_memory_does_not_grow_with_episodes(vector):
    short = NavigationVectorEnv(vector.unwrapped.navigation, 1)
    short.reset(seed=0)

    def episodes(count):
        for _ in range(count // 4):
            short.step(np.zeros((4, 2)))
        return resident_mb() - ways_to_goals(short)

    before = episodes(200)
    assert episodes(400) - before < 1.0  # a leak of 2.5 kB for each would show


def ways_to_goals(vector):
    """Of the warehouse each goal's ways are worked out once, and kept."""
    aisles = getattr(vector.unwrapped.navigation, "_aisles", None)
    return 0 if aisles is None else sum(field.nbytes for field in aisles._lengths.values()) / 1e6
