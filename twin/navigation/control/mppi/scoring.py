"""From the raw scores of the critics to one total per rollout, as the parameters weigh them."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import F32
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.costmaps.costmap import FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION

NAMES = [field.name for field in fields(MPPIConfig) if field.name.endswith("Critic")]
"""Of the critics, in the order of their rows."""


def cost_tables(
    config: MPPIConfig, inscribed_radius: float, cost_scaling_factor: float, near_goal: bool, vx_max: float
) -> F32:
    """Return, by cost, shape (3, 256): CostCritic, ObstaclesCritic, and the speed that is allowed [m/s]."""
    cost = np.arange(256, dtype=np.float64)
    critic = config.CostCritic
    clearance = inscribed_radius - np.log(np.maximum(cost, 1.0) / 252.0) / cost_scaling_factor
    clearance = np.where(cost >= INSCRIBED_INFLATED_OBSTACLE, 0.0, clearance)
    pointwise = np.where(cost >= critic.near_collision_cost, critic.critical_cost, 0.0 if near_goal else cost)
    obstacles, speed = config.ObstaclesCritic, config.SpeedCritic
    surface = clearance - inscribed_radius
    margin = np.maximum(obstacles.collision_margin_distance - surface, 0.0)
    repulsion = 0.0 if near_goal else obstacles.repulsion_weight
    # Scores matter by their differences: Nav2's inflation radius in the repulsion drops out.
    keep_off = obstacles.critical_weight * margin - repulsion * surface
    allowed = vx_max * speed.cost_scaling_gain * clearance / speed.cost_scaling_dist
    tables = np.stack([pointwise, keep_off - keep_off[1], np.clip(allowed, speed.min_speed, math.inf)])
    for unknown in (FREE_SPACE, NO_INFORMATION):
        tables[:, unknown] = (0.0, 0.0, vx_max)
    return tables.astype(np.float32)


class Totals:
    """The weighted sum of the critics that score."""

    def __init__(self, config: MPPIConfig) -> None:
        self._names = [name for name in NAMES if config.scores(name)]
        critics = [getattr(config, name) for name in self._names]
        rows = [NAMES.index(name) for name in self._names]
        # Nav2 weighs costs as fractions of 254.
        weights = [critic.cost_weight / (254.0 if critic is config.CostCritic else 1.0) for critic in critics]
        powers = [critic.cost_power for critic in critics]
        self._terms = np.array([rows, weights, powers], dtype=np.float32)
        self._collision = np.float32(config.CostCritic.collision_cost)

    def write(self, raw: F32, hit: NDArray[np.uint8], active: dict[str, bool], out: F32) -> None:
        """Write the weighted sum of the raw scores, shape (CRITIC_COUNT, batch), to `out`, shape (batch).

        Args:
            raw: What the compiled loops found.
            hit: Which rollouts collide: they get CostCritic's collision cost.
            active: Critics that score now; others that are not named do too.
            out: Written.
        """
        terms = self._terms[:, [active.get(name, True) for name in self._names]]
        _weigh(raw, terms, hit, self._collision, out)


@fast_jit
def _weigh(raw: F32, terms: F32, hit: NDArray[np.uint8], collision: np.float32, out: F32) -> None:
    """Write the sum of (weight * raw score)^power to `out`, shape (batch).

    Args:
        raw: Shape (CRITIC_COUNT, batch).
        terms: Row of `raw`, weight and power of each critic, shape (3, n).
        hit: Which rollouts collide, shape (batch).
        collision: What these pay more.
        out: Written.
    """
    batch = out.shape[0]
    for k in range(batch):
        out[k] = collision if hit[k] != 0 else np.float32(0.0)
    for i in range(terms.shape[1]):
        row, weight, power = raw[int(terms[0, i])], terms[1, i], int(terms[2, i])
        if power == 1:
            for k in range(batch):
                out[k] += weight * row[k]
        else:
            for k in range(batch):
                out[k] += (weight * row[k]) ** power
