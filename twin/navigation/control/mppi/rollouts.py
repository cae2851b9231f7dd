"""All rollouts of one command: where they lead, and what each of them scores."""

from __future__ import annotations

import numpy as np

from twin.geometry import Array
from twin.navigation.control.mppi import kernels
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.kernels import F32
from twin.navigation.control.mppi.path_critics import (
    follow_target,
    score_align,
    score_angle,
    score_follow,
)
from twin.navigation.control.mppi.scene import Scene
from twin.navigation.control.mppi.scoring import Totals


class Rollouts:
    """Memory for a batch, used again for every command."""

    def __init__(self, config: MPPIConfig) -> None:
        self._config = config
        self._totals = Totals(config)
        steps, batch = config.time_steps, config.batch_size
        self._state = np.zeros((8, batch), dtype=np.float32)
        self._points = np.zeros((3, steps, batch), dtype=np.float32)
        self._raw = np.zeros((kernels.CRITIC_COUNT, batch), dtype=np.float32)
        self.hit = np.zeros(batch, dtype=np.uint8)
        """Which of them collide."""
        self.total = np.zeros(batch, dtype=np.float32)
        """What each scores; less is better."""
        self.delays = np.array(
            [round(config.model_delay_vx / config.model_dt), round(config.model_delay_wz / config.model_dt)]
        )
        """Steps until a command of vx, of wz has an effect."""

    def simulate(self, scene: Scene, noise: F32, mean: F32, under_way: F32) -> None:
        """Drive every copy of the controls.

        Args:
            scene: Where.
            noise: Shape (2, time_steps, batch_size): of vx and wz.
            mean: The controls, shape (2, time_steps).
            under_way: Commands that had no effect yet, shape (2, n), the latest last.
        """
        config, local = self._config, scene.local
        goal, angle = config.GoalCritic, config.GoalAngleCritic
        near = [
            config.scores("GoalCritic") and local.length <= goal.threshold_to_consider,
            config.scores("GoalAngleCritic") and local.length <= angle.threshold_to_consider,
            angle.symmetric_yaw_tolerance,
        ]
        dead = config.VelocityDeadbandCritic.deadband_velocities
        if not config.scores("VelocityDeadbandCritic"):
            dead = (0.0, 0.0, 0.0)
        kernels.roll_out(
            noise,
            mean,
            under_way,
            self.delays,
            scene.start,
            scene.limits,
            np.float32(config.model_dt),
            scene.costmap.costs,
            np.float32(1.0 / scene.costmap.resolution),
            scene.tables,
            np.array([config.CostCritic.trajectory_point_step, *scene.cover.costs]),
            scene.cover.circles,
            scene.cover.outline,
            scene.cover.padded,
            np.float32(config.CostCritic.critical_cost),
            np.array([*scene.path[:, -1], *near, local.length], dtype=np.float32),
            np.array([config.scores("TwirlingCritic"), dead[0], dead[2]], dtype=np.float32),
            self._state,
            self._points,
            self._raw,
            self.hit,
        )

    def score(self, scene: Scene) -> int:
        """Write `total`; return the pose of the local path that the rollouts are drawn to."""
        config, length, raw = self._config, scene.local.length, self._raw
        stride = max(1, config.batch_size // 256)
        furthest = kernels.furthest_reached(self._state, scene.path, scene.along, stride)
        at = follow_target(config, scene, furthest)
        active = {
            "GoalCritic": length <= config.GoalCritic.threshold_to_consider,
            "GoalAngleCritic": length <= config.GoalAngleCritic.threshold_to_consider,
            "PathAlignCritic": score_align(config, scene, furthest, self._points, self.hit, raw),
            "PathFollowCritic": score_follow(config, scene, at, self._state, raw),
            "PathAngleCritic": score_angle(config, scene, furthest, self._state, raw),
            "PreferForwardCritic": length >= config.PreferForwardCritic.threshold_to_consider
            and not scene.local.reversing,
        }
        self._totals.write(raw, self.hit, active, self.total)
        return at

    def every(self, trajectories: int, steps: int) -> Array:
        """Return x, y from the costmap's corner [m] of every so many rollouts at every so many steps.

        Shape (n, m, 2).
        """
        return self._points[:2, ::steps, ::trajectories].transpose(2, 1, 0).astype(np.float64)
