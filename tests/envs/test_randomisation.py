"""Episodes differ as far as they may, and depend on seed and number only."""

import numpy as np
import pytest

from twin.envs.randomisation import NONE, Episode, Randomisation
from twin.errors import GymError

WIDE = Randomisation(
    mass=0.2,
    friction=0.5,
    wheel_radius=0.02,
    wheel_mismatch=0.01,
    latency=(0.02, 0.1),
    lidar_noise=(0.01, 0.03),
)


def test_robots_differ_as_far_as_they_may():
    draws = np.array([Episode(seed, number).robot(WIDE) for seed in range(100) for number in range(4)])
    mass, friction, left, right, latency, noise = draws.T
    for values, low, high in (
        (mass, 0.8, 1.2),
        (friction, 0.5, 1.5),
        ((left + right) / 2.0, 0.98, 1.02),
        (left - right, -0.01, 0.01),
        (latency, 0.02, 0.1),
        (noise, 0.01, 0.03),
    ):
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high
        assert abs(values.mean() - (low + high) / 2.0) < 0.05 * (high - low)
    independent = np.array((mass, friction, left + right, left - right, latency, noise))
    np.testing.assert_allclose(np.corrcoef(independent), np.eye(6), atol=0.15)


def test_without_randomisation_the_robot_is_as_its_file_says():
    assert Episode(3, 4).robot(NONE) == (1.0, 1.0, 1.0, 1.0, 0.0, 0.01)


def test_an_episode_depends_on_seed_and_number_only():
    one, same = Episode(7, 2), Episode(7, 2)
    same.normal(5, 10), same.uniform(1, 3)
    assert one.robot(WIDE) == same.robot(WIDE)
    np.testing.assert_array_equal(one.normal(3, 36), same.normal(3, 36))
    for other in (Episode(8, 2), Episode(7, 3)):
        assert other.robot(WIDE) != one.robot(WIDE)
        assert (other.normal(3, 36) != one.normal(3, 36)).all()


def test_no_two_draws_of_an_episode_share_numbers():
    episode = Episode(1, 0)
    normal = [episode.constants(5), episode.normal(0, 5), episode.normal(1, 5)]
    uniform = [episode.walks(2).ravel()[:5], episode.uniform(0, 5), episode.uniform(1, 5)]
    for draws in (normal, uniform):
        assert len(np.unique(np.concatenate(draws))) == 15


def test_all_wrong_numbers_are_told_at_once():
    with pytest.raises(GymError) as caught:
        Randomisation(mass=1.5, friction=-0.1, latency=(0.2, 0.1))
    lines = str(caught.value).splitlines()
    assert [line.split(" ")[0] for line in lines] == [
        "randomisation.mass",
        "randomisation.friction",
        "randomisation.latency",
    ]
