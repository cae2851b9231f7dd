"""How MPPI's critics weigh: the tables of costs by their formulas, and the sum of all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.navigation.control.mppi import arrays
from twin.navigation.control.mppi.config import (
    CostCriticConfig,
    GoalCriticConfig,
    MPPIConfig,
    ObstaclesCriticConfig,
    TwirlingCriticConfig,
)
from twin.navigation.control.mppi.scoring import CostTables, Totals, cost_tables
from twin.navigation.costmaps.costmap import Costmap, inflation_costs

COSTMAP = Costmap(
    costs=np.zeros((1, 1), dtype=np.uint8), resolution=0.05, inscribed_radius=0.2, cost_scaling_factor=4.0
)


def away(cost: int) -> float:
    """Return how far from an obstacle a cell of this cost is, by the inflation."""
    distances = np.arange(0.201, 2.0, 1e-4)
    costs = inflation_costs(distances, inscribed_radius=0.2, inflation_radius=9.0, cost_scaling_factor=4.0)
    return float(distances[costs == cost].mean())


@pytest.mark.parametrize("near_goal", [False, True])
def test_what_costs_are_worth(near_goal: bool) -> None:
    pointwise, obstacles, speed = cost_tables(MPPIConfig(), COSTMAP, near_goal=near_goal, vx_max=0.8)
    for cost in (60, 120, 180, 240):
        surface = away(cost) - 0.2
        assert pointwise[cost] == (0.0 if near_goal else cost)
        # Of Nav2's ObstaclesCritic: distances within the margin, and repulsion, unless the goal is near.
        want = 20.0 * max(0.10 - surface, 0.0) - (0.0 if near_goal else 1.5 * surface)
        far = 0.0 if near_goal else -1.5 * math.log(252.0) / 4.0
        assert obstacles[cost] == pytest.approx(want - far, abs=0.05)
        # Regulated pure pursuit's rule: at 0.6 m full speed, in proportion nearer, at least 0.25 m/s.
        assert speed[cost] == pytest.approx(max(0.8 * away(cost) / 0.6, 0.25), abs=0.01)
    assert pointwise[[252, 253, 254]].tolist() == [0.0 if near_goal else 252.0, 300.0, 300.0]
    assert speed[[253, 254]].tolist() == [0.25, 0.25]
    for free in (0, 255):
        assert (pointwise[free], obstacles[free], speed[free]) == (0.0, 0.0, pytest.approx(0.8))


def test_tables_are_made_anew_when_something_changes() -> None:
    tables, config = CostTables(MPPIConfig()), MPPIConfig()
    for near_goal, vx_max in ((False, 0.5), (True, 0.5), (True, 0.9), (False, 0.9)):
        want = cost_tables(config, COSTMAP, near_goal=near_goal, vx_max=vx_max)
        found = tables.of(COSTMAP, near_goal=near_goal, vx_max=vx_max)
        assert np.array_equal(found, want)
        assert tables.of(COSTMAP, near_goal=near_goal, vx_max=vx_max) is found


def test_the_total_is_the_sum_of_the_weighted_scores_raised_to_their_powers() -> None:
    config = MPPIConfig(
        critics=("CostCritic", "GoalCritic", "TwirlingCritic", "ObstaclesCritic"),
        CostCritic=CostCriticConfig(cost_weight=127.0, collision_cost=5000.0),
        GoalCritic=GoalCriticConfig(cost_weight=2.0, cost_power=2),
        TwirlingCritic=TwirlingCriticConfig(cost_weight=3.0),
        ObstaclesCritic=ObstaclesCriticConfig(enabled=False),
    )
    raw = np.random.default_rng(0).uniform(0.0, 3.0, (arrays.CRITIC_COUNT, 6)).astype(np.float32)
    hit, out = np.array([0, 1, 0, 0, 1, 0], np.uint8), np.full(6, np.nan, dtype=np.float32)
    Totals(config).write(raw, hit, {}, out)
    cost, goal, turns = 0.5 * raw[arrays.COST], (2.0 * raw[arrays.GOAL]) ** 2, 3.0 * raw[arrays.TWIRLING]
    assert out == pytest.approx(5000.0 * hit + cost + goal + turns, rel=1e-5)
    Totals(config).write(raw, hit, {"GoalCritic": False, "TwirlingCritic": True}, out)
    assert out == pytest.approx(5000.0 * hit + cost + turns, rel=1e-5)
