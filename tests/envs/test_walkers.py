"""Walkers of environments walk and give way as those of scenarios do."""

import numpy as np
import pytest

from twin.envs.walkers import WalkerConfig, Walkers
from twin.envs.warehouse_nav import WALKERS
from twin.files.shipped import beside
from twin.geometry import Pose2
from twin.runtime.obstacles import Walker
from twin.scenario.schema import load
from twin.scenario.world import Obstacle


def test_they_are_those_of_the_patrol():
    obstacles = load(beside("scenarios") / "warehouse_patrol.yaml").world.obstacles
    as_configs = [
        WalkerConfig(
            size=obstacle.size,
            route=((obstacle.pose.x, obstacle.pose.y), *obstacle.route),
            speed=obstacle.speed,
            yields_within=obstacle.yields_within,
            patience=obstacle.patience,
        )
        for obstacle in obstacles
    ]
    assert tuple(as_configs) == WALKERS


@pytest.mark.parametrize("seed", range(3))
def test_they_walk_as_in_a_run(seed):
    rng = np.random.default_rng(seed)
    config = WalkerConfig(
        size=(0.4, 0.6, 1.2), route=((0.0, 0.0), (3.0, 0.0), (3.0, 2.0)), speed=0.5, pace=0.0, patience=1.0
    )
    walkers = Walkers([config], 2)
    for i in range(2):
        walkers.begin(i, np.array([[0.0, 0.0, 0.5]]))
    obstacle = Obstacle.model_validate(
        {"name": "w", "size": config.size, "route": config.route[1:], "speed": 0.5, "patience": 1.0}
    )
    positions, run = np.zeros((2, 1, 3)), [Walker(obstacle), Walker(obstacle)]
    robots = rng.uniform(-1.0, 4.0, (2, 2))
    aim, waited = rng.uniform(-1.0, 4.0, (2, 2)), 0
    for _ in range(1500):
        robots += 0.01 * np.sign(aim - robots)
        if rng.uniform() < 0.01:
            aim = rng.uniform(-1.0, 4.0, (2, 2))
        walkers.walk(0.02, robots, positions)
        for i, walker in enumerate(run):
            waited += not walker.walk(0.02, [Pose2(*robots[i], 0.0)])
            np.testing.assert_allclose(positions[i, 0, :2], walker.pose[:2], atol=1e-9)
            assert walkers.poses(i)[0] == pytest.approx(walker.pose, abs=1e-9)
    assert 10 < waited < 2900


def test_they_begin_anywhere_either_way_at_a_pace_of_their_own():
    walkers = Walkers(WALKERS, 200)
    numbers = np.random.default_rng(0).uniform(size=(200, len(WALKERS), 3))
    for i in range(200):
        walkers.begin(i, numbers[i])
    walks = walkers.walks
    for k, config in enumerate(WALKERS):
        assert 0.0 <= walks.along[:, k].min() < 0.1 * config.knots[-1]
        assert 0.9 * config.knots[-1] < walks.along[:, k].max() <= config.knots[-1]
        assert set(walks.direction[:, k]) == {1, -1}
        assert 0.7 * config.speed <= walks.speed[:, k].min() < walks.speed[:, k].max() <= 1.3 * config.speed
