"""What the compiled loops of MPPI take and write.

Arrays are time-major, shape (time_steps, batch_size), single precision: the inner loops run over the batch,
and the compiler does eight rollouts at once. Positions are in metres from the costmap's corner.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from twin.navigation.control.footprint_cover import F32, FootprintCover

CONSTRAINT, COST, OBSTACLES, GOAL, GOAL_ANGLE, ALIGN, FOLLOW, ANGLE, FORWARD = range(9)
TWIRLING, DEADBAND, SPEED, LAG = range(9, 13)
"""Rows of the critics' raw scores, as `MPPIConfig` orders the critics.

LAG, mean distance that is left of the local path, is a part of FOLLOW.
"""
CRITIC_COUNT = 13

X, Y, COS, SIN, YAW, V, W, LENGTH = range(8)
"""Rows of the state."""

Number: TypeAlias = Any
"""In the precision that a compiled function's caller computes in."""


class Limits(NamedTuple):
    """Of the drive, single precision; the least turning radius is 0 where it turns in place."""

    vx_max: Number
    vx_min: Number
    wz_max: Number
    ax_max: Number
    ax_min: Number
    az_max: Number
    min_turning_r: Number


class Ground(NamedTuple):
    """What is driven over."""

    costs: NDArray[np.uint8]
    """The costmap."""
    per_metre: np.float32
    """Cells per metre."""
    tables: F32
    """Shape (3, 256), by cost: raw CostCritic, raw ObstaclesCritic, allowed speed [m/s]."""
    cover: FootprintCover
    """Of the robot."""


class Commands(NamedTuple):
    """What the rollouts drive with."""

    noise: F32
    """Shape (2, time_steps, batch): of vx and wz."""
    mean: F32
    """Shape (2, time_steps): the controls."""
    history: F32
    """Shape (2, n): commands that had no effect yet, a step of the model apart, the latest last."""
    delays: NDArray[np.int64]
    """Steps until a command has an effect: of vx, of wz."""


class Wanted(NamedTuple):
    """What is scored on the way, and by what."""

    goal: F32
    """x, y, yaw."""
    length: np.float32
    """Of the local path [m]."""
    position: bool
    """Whether GoalCritic counts."""
    heading: bool
    """Whether GoalAngleCritic counts."""
    symmetric: bool
    """Whether the opposite heading is as good."""
    twirling: bool
    """Whether TwirlingCritic counts."""
    deadband: F32
    """Of v and w; zeros: none."""
    look_every: int
    """Steps between looks at the costmap; 0: none."""
    near_cost: np.float32
    """Added to CostCritic where only the padding of the footprint touches something."""


class Batch(NamedTuple):
    """What becomes of the rollouts."""

    state: F32
    """Shape (8, batch): at their ends."""
    points: F32
    """Shape (3, time_steps, batch): x, y, yaw after each step."""
    raw: F32
    """Shape (CRITIC_COUNT, batch)."""
    hit: NDArray[np.uint8]
    """Shape (batch): which collide."""
