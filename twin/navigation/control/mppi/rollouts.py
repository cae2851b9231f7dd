"""All rollouts of one command: where they lead, and what each of them scores."""

from __future__ import annotations

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.control.critic import Trajectories
from twin.navigation.control.footprint_cover import F32
from twin.navigation.control.mppi import arrays
from twin.navigation.control.mppi.arrays import Batch, Commands, Wanted
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.path_critics import (
    follow_target,
    furthest_reached,
    score_align,
    score_angle,
    score_follow,
)
from twin.navigation.control.mppi.rollout_kernel import roll_out
from twin.navigation.control.mppi.scene import Scene
from twin.navigation.control.mppi.scoring import Totals
from twin.navigation.plugins import own_critics


class Rollouts:
    """Memory for a batch, used again for every command."""

    def __init__(self, config: MPPIConfig) -> None:
        self._config = config
        self._totals = Totals(config)
        self._critics = own_critics(config)
        steps, batch = config.time_steps, config.batch_size
        self.batch = Batch(
            state=np.zeros((8, batch), dtype=np.float32),
            points=np.zeros((3, steps, batch), dtype=np.float32),
            raw=np.zeros((arrays.CRITIC_COUNT, batch), dtype=np.float32),
            hit=np.zeros(batch, dtype=np.uint8),
        )
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
        commands = Commands(noise=noise, mean=mean, history=under_way, delays=self.delays)
        dt = np.float32(self._config.model_dt)
        roll_out(commands, scene.start, scene.limits, dt, scene.ground, self._wanted(scene), self.batch)

    def _wanted(self, scene: Scene) -> Wanted:
        config, length = self._config, scene.local.length
        goal, angle, dead = config.GoalCritic, config.GoalAngleCritic, config.VelocityDeadbandCritic
        v, _, w = dead.deadband_velocities if config.scores("VelocityDeadbandCritic") else (0.0, 0.0, 0.0)
        return Wanted(
            goal=np.ascontiguousarray(scene.path[:, -1]),
            length=np.float32(length),
            position=config.scores("GoalCritic") and length <= goal.threshold_to_consider,
            heading=config.scores("GoalAngleCritic") and length <= angle.threshold_to_consider,
            symmetric=angle.symmetric_yaw_tolerance,
            twirling=config.scores("TwirlingCritic"),
            deadband=np.array([v, w], dtype=np.float32),
            look_every=config.CostCritic.trajectory_point_step,
            near_cost=np.float32(config.CostCritic.critical_cost),
        )

    def score(self, scene: Scene, noise: F32, mean: F32) -> int:
        """Write `total`; return the pose of the local path that the rollouts are drawn to.

        Args:
            scene: Where; as the others as for `simulate`.
            noise: Shape (2, time_steps, batch_size).
            mean: Shape (2, time_steps).
        """
        config, length = self._config, scene.local.length
        state, points, raw, hit = self.batch
        stride = max(1, config.batch_size // 256)
        furthest = furthest_reached(state, scene.path, scene.along, stride)
        at = follow_target(config, scene, furthest)
        active = {
            "PathAlignCritic": score_align(config, scene, furthest, points, hit, raw),
            "PathFollowCritic": score_follow(config, scene, at, state, raw),
            "PathAngleCritic": score_angle(config, scene, furthest, state, raw),
            "PreferForwardCritic": length >= config.PreferForwardCritic.threshold_to_consider
            and not scene.local.reversing,
        }
        self._totals.write(raw, hit, active, self.total)
        if self._critics:
            trajectories = self._trajectories(scene, noise + mean[:, :, None])
            for critic in self._critics:
                self.total += critic.score(trajectories).astype(np.float32)
        return at

    def _trajectories(self, scene: Scene, commands: F32) -> Trajectories:
        """Return the rollouts as a user's critics see them; commands: shape (2, time_steps, batch)."""
        corner = np.array([*scene.costmap.origin, 0.0])
        x, y, yaw, v, w = map(float, scene.start)
        return Trajectories(
            poses=self.batch.points.transpose(2, 1, 0) + corner,
            commands=commands.transpose(2, 1, 0).astype(np.float64),
            start=Pose2(x + corner[0], y + corner[1], yaw),
            velocity=(v, w),
            path=scene.path.T + corner,
            costmap=scene.costmap,
        )

    def every(self, trajectories: int, steps: int) -> Array:
        """Return x, y from the costmap's corner [m] of every so many rollouts at every so many steps.

        Shape (n, m, 2).
        """
        return self.batch.points[:2, ::steps, ::trajectories].transpose(2, 1, 0).astype(np.float64)
