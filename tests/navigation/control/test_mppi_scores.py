"""MPPI's rollouts and critics: driven and scored one by one, costs by their formulas, and the sum of all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.control.footprint_cover import CoverOf
from twin.navigation.control.mppi import arrays
from twin.navigation.control.mppi.arrays import Batch, Commands, Ground, Limits, Wanted
from twin.navigation.control.mppi.config import (
    CostCriticConfig,
    GoalCriticConfig,
    MPPIConfig,
    ObstaclesCriticConfig,
    TwirlingCriticConfig,
)
from twin.navigation.control.mppi.path_critics import furthest_reached
from twin.navigation.control.mppi.rollout_kernel import roll_out
from twin.navigation.control.mppi.scoring import Totals, cost_tables
from twin.navigation.costmaps.costmap import Costmap, inflation_costs
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.maps.occupancy_map import OccupancyMap

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
    pointwise, obstacles, speed = cost_tables(
        MPPIConfig(), COSTMAP.inscribed_radius, COSTMAP.cost_scaling_factor, near_goal, 0.8
    )
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


LIMITS = Limits(*(np.float32(value) for value in (0.6, -0.3, 1.5, 2.1, -3.1, 4.3, 0.4)))
STEPS, BATCH, DT = 9, 12, 0.1
START = (2.0, 2.0, 0.4, 0.2, -0.3)
GOAL = (2.6, 2.1, -2.9)
DELAYS, LOOK_EVERY, LENGTH = (2, 1), 2, 0.35


def rolled_out(commands: Commands, ground: Ground, symmetric: bool) -> dict[int, np.ndarray]:
    """The scores of every rollout, one after the other and in double precision."""
    scores = {row: np.zeros(BATCH) for row in range(arrays.CRITIC_COUNT)}
    mean, history = commands.mean.astype(float), commands.history.astype(float)
    noise = commands.noise.astype(float)
    for k in range(BATCH):
        x, y, yaw, v, w = START
        length = 0.0
        for t in range(STEPS):
            tv, tw = t - DELAYS[0], t - DELAYS[1]
            if tv < 0:
                v = history[0, tv]
            else:
                up, down = (0.21, 0.31) if v >= 0.0 else (0.31, 0.21)
                v = min(max(mean[0, tv] + noise[0, tv, k], v - down), v + up)
            w = history[1, tw] if tw < 0 else min(max(mean[1, tw] + noise[1, tw, k], w - 0.43), w + 0.43)
            x += v * DT * math.cos(yaw + 0.5 * w * DT)
            y += v * DT * math.sin(yaw + 0.5 * w * DT)
            yaw += w * DT
            length += abs(v) * DT
            over = max(v - 0.6, 0.0) + max(-0.3 - v, 0.0) + max(0.4 - abs(v) / max(abs(w), 1e-6), 0.0)
            off = abs(math.remainder(yaw - GOAL[2], 2.0 * math.pi))
            for row, score in (
                (arrays.CONSTRAINT, over * DT),
                (arrays.FORWARD, max(-v, 0.0) * DT),
                (arrays.DEADBAND, (max(0.1 - abs(v), 0.0) + max(0.2 - abs(w), 0.0)) * DT),
                (arrays.TWIRLING, abs(w) / STEPS),
                (arrays.LAG, max(LENGTH - length, 0.0) / STEPS),
                (arrays.GOAL, math.hypot(x - GOAL[0], y - GOAL[1]) / STEPS),
                (arrays.GOAL_ANGLE, (min(off, math.pi - off) if symmetric else off) / STEPS),
            ):
                scores[row][k] += score
            cost = int(ground.costs[int(y * 20.0), int(x * 20.0)])
            if t % LOOK_EVERY == LOOK_EVERY - 1 and cost not in (0, 255):
                looks = STEPS // LOOK_EVERY
                scores[arrays.COST][k] += ground.tables[0, cost] / looks
                scores[arrays.OBSTACLES][k] += ground.tables[1, cost] / looks
                scores[arrays.SPEED][k] += max(abs(v) - ground.tables[2, cost], 0.0) / looks
    return scores


@pytest.mark.parametrize("symmetric", [False, True])
def test_rollouts_are_driven_and_scored_step_by_step(symmetric: bool) -> None:
    random = np.random.default_rng(3)
    patches = np.kron(random.integers(0, 253, (16, 16)), np.ones((5, 5))).astype(np.uint8)
    patches[50:] = 255
    costmap = Costmap(costs=patches, resolution=0.05, inscribed_radius=0.2, cost_scaling_factor=4.0)
    cover = CoverOf(rectangle(0.4, 0.3), consider_footprint=False).on(costmap)
    tables = random.uniform(0.0, 1.0, (3, 256)).astype(np.float32)
    tables[2] *= 0.4
    ground = Ground(costs=patches, per_metre=np.float32(20.0), tables=tables, cover=cover)
    commands = Commands(
        noise=random.normal(0.0, 0.4, (2, STEPS, BATCH)).astype(np.float32),
        mean=random.normal(0.2, 0.4, (2, STEPS)).astype(np.float32),
        history=np.array([[0.3, 0.25, -0.12], [0.5, 0.3, 0.23]], dtype=np.float32),
        delays=np.array(DELAYS),
    )
    wanted = Wanted(
        goal=np.array(GOAL, dtype=np.float32),
        length=np.float32(LENGTH),
        position=True,
        heading=True,
        symmetric=symmetric,
        twirling=True,
        deadband=np.array([0.1, 0.2], dtype=np.float32),
        look_every=LOOK_EVERY,
        near_cost=np.float32(0.0),
    )
    batch = Batch(
        state=np.full((8, BATCH), np.nan, dtype=np.float32),
        points=np.full((3, STEPS, BATCH), np.nan, dtype=np.float32),
        raw=np.full((arrays.CRITIC_COUNT, BATCH), np.nan, dtype=np.float32),
        hit=np.ones(BATCH, dtype=np.uint8),
    )
    start = np.array(START, dtype=np.float32)
    roll_out(commands, start, LIMITS, np.float32(DT), ground, wanted, batch)
    want = rolled_out(commands, ground, symmetric)
    assert not batch.hit.any()
    for row, scores in want.items():
        assert batch.raw[row] == pytest.approx(scores, abs=2e-4), row
    starts = np.full((2, 1, BATCH), 2.0)
    gone = np.hypot(*np.diff(np.concatenate([starts, batch.points[:2]], axis=1), axis=1)).sum(axis=0)
    assert batch.state[arrays.LENGTH] == pytest.approx(gone, abs=1e-3)
    assert batch.state[arrays.YAW] == pytest.approx(batch.points[2, -1])
    assert batch.state[arrays.COS] == pytest.approx(np.cos(batch.points[2, -1]), abs=1e-4)


@pytest.mark.parametrize(
    ("along", "hit", "near"), [(0.0, True, False), (-0.07, False, True), (-0.4, False, False)]
)
def test_what_a_rollout_touches(along: float, hit: bool, near: bool) -> None:
    """It drives 0.3 m straight ahead, to where the robot's nose is at an obstacle, or so far before it."""
    costs = np.zeros((80, 80), dtype=np.int8)
    costs[36:44, 51:54] = 100
    room = OccupancyMap(data=costs, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    footprint = rectangle(0.4, 0.3)
    config = CostmapConfig(
        footprint=tuple((float(x), float(y)) for x, y in footprint),
        footprint_padding=0.0,
        inflation_radius=1.0,
    )
    costmap = LayeredCostmap(config=config, static_map=room).costmap
    cover = CoverOf(footprint, consider_footprint=True, padding=0.08).on(costmap)
    tables = np.zeros((3, 256), dtype=np.float32)
    tables[2] = 9.0
    none = np.zeros(1, dtype=np.float32)
    batch = Batch(
        state=np.zeros((8, 1), np.float32),
        points=np.zeros((3, 3, 1), np.float32),
        raw=np.zeros((arrays.CRITIC_COUNT, 1), np.float32),
        hit=np.zeros(1, np.uint8),
    )
    roll_out(
        Commands(
            noise=np.zeros((2, 3, 1), np.float32),
            mean=np.array([[0.5] * 3, [0.0] * 3], dtype=np.float32),
            history=np.zeros((2, 1), np.float32),
            delays=np.zeros(2, np.int64),
        ),
        np.array([2.07 + along, 2.0, 0.0, 0.5, 0.0], dtype=np.float32),
        LIMITS,
        np.float32(0.2),
        Ground(costs=costmap.costs, per_metre=np.float32(20.0), tables=tables, cover=cover),
        Wanted(
            goal=np.zeros(3, np.float32),
            length=none[0],
            position=False,
            heading=False,
            symmetric=False,
            twirling=False,
            deadband=np.zeros(2, np.float32),
            look_every=1,
            near_cost=np.float32(6.0),
        ),
        batch,
    )
    assert (bool(batch.hit[0]), bool(batch.raw[arrays.COST, 0] > 0.0)) == (hit, near)
    if near:
        assert batch.raw[arrays.COST, 0] == pytest.approx(2.0), "at the last of three looks"


@pytest.mark.parametrize("ends", [[(0.42, 0.0)], [(0.1, 0.3), (0.8, -0.2)], [(5.0, 0.0)], [(-1.0, 0.0)]])
def test_how_far_along_the_path_any_rollout_gets(ends: list[tuple[float, float]]) -> None:
    along = np.arange(0.0, 2.01, 0.05)
    path = np.stack([along, np.zeros_like(along), np.zeros_like(along)]).astype(np.float32)
    state = np.zeros((8, len(ends)), dtype=np.float32)
    state[[arrays.X, arrays.Y]] = np.array(ends).T
    for length, most in ((9.0, 40), (0.3, 6)):
        state[arrays.LENGTH] = length
        want = max(min(int(np.argmin(np.hypot(along - x, y))), most) for x, y in ends)
        assert furthest_reached(state, path, along.astype(np.float32), 1) == want
