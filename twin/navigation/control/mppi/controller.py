"""Model predictive path integral control, as nav2_mppi_controller has it.

Williams, Drews, Goldfain, Rehg, Theodorou: Information-theoretic model predictive control, T-RO 2018. Every
cycle simulates `batch_size` noisy copies of the present controls, scores them with the critics, and moves the
controls by the noise that did well. What Nav2 does differently is named where it is.
"""

from __future__ import annotations

import math
from functools import lru_cache, partial

import numpy as np

from twin.geometry import Array
from twin.navigation.control.controller import Controller, Situation
from twin.navigation.control.detour import DetouringPathHandler, free_points
from twin.navigation.control.footprint_cover import F32, CoverOf
from twin.navigation.control.mppi import controls
from twin.navigation.control.mppi.arrays import Ground
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.controls import NoiseBank, SentCommands
from twin.navigation.control.mppi.pursuit import pursue
from twin.navigation.control.mppi.rollouts import Rollouts
from twin.navigation.control.mppi.scene import Scene, expected_speed, limits_of
from twin.navigation.control.mppi.scoring import cost_tables
from twin.navigation.control.path_handler import PathHandlerConfig
from twin.navigation.failures import NoValidControl

_EXACT = 3
"""The first rollouts have no noise: one keeps the controls as they are, one brakes, one pursues the path."""
_SMOOTHED = 4
"""So many commands before them weigh in when the controls are smoothed."""
_FILTERS = {
    1: np.full(9, 1.0 / 9.0, dtype=np.float32),
    2: (np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21]) / 231.0).astype(np.float32),
}
"""Savitzky-Golay, by order."""


class MPPI(Controller):
    """Goes on with the controls it has when a new path comes."""

    Config = MPPIConfig
    config: MPPIConfig

    @property
    def trajectory(self) -> Array | None:
        """What the last command is the beginning of, in the path's frame: shape (time_steps, 3)."""
        if self._scene is None:
            return None
        back = self._scene.to_grid.inverse()
        return np.column_stack([back.apply(self._leads[:, :2]), self._leads[:, 2] + back.yaw])

    @property
    def candidates(self) -> Array | None:
        """Some of the rollouts of the last command, in the path's frame: shape (n, m, 2) [m]."""
        if self._scene is None or not self.config.visualize:
            return None
        shown = self.config.TrajectoryVisualizer
        return self._scene.to_grid.inverse().apply(
            self._rollouts.every(shown.trajectory_step, shown.time_step)
        )

    @property
    def max_speed(self) -> float:
        """vx_max [m/s]."""
        return self.config.vx_max

    @property
    def reverses(self) -> bool:
        """Whether it drives backwards."""
        return self.config.enforce_path_inversion and self.config.vx_min < 0.0

    def _build(self) -> None:
        config, critic = self.config, self.config.CostCritic
        self._noise = NoiseBank(config)
        self._rollouts = Rollouts(config)
        self._tables = lru_cache(maxsize=1)(partial(cost_tables, config))
        self._leads = np.zeros((config.time_steps, 3))
        self._cover = CoverOf(
            self.footprint, consider_footprint=critic.consider_footprint, padding=critic.footprint_padding
        )
        self._handler = DetouringPathHandler(
            PathHandlerConfig.of(config),
            to_cusps=self.reverses,
            prune_distance=config.prune_distance,
            detours=config.detours,
        )

    def set_plan(self, path: Array) -> None:
        """Follow another path; see `Controller.set_plan`."""
        self._handler.accept(path)
        super().set_plan(path)

    def reset(self) -> None:
        """Forget the path, and the controls found for it."""
        super().reset()
        self._handler.reset()
        self._scene: Scene | None = None
        self._forget_controls()

    def compute_velocity_commands(self, now: Situation) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]); see `Controller.compute_velocity_commands`.

        Raises:
            NoValidControl: every rollout collides, also after a start from rest.
        """
        scene = self._look(now)
        for _ in range(self.config.retry_attempt_limit + 1):
            if self._optimize(scene, now.dt):
                break
            self._forget_controls()
        else:
            self._scene = None
            raise NoValidControl(f"all {self.config.batch_size} rollouts of MPPI collide")
        command = float(self._mean[0, 0]), float(self._mean[1, 0])
        self._remember(command, now.dt)
        self._scene = scene
        self._shift(now.dt)
        return command

    # Preparation

    def _forget_controls(self) -> None:
        self._mean = np.zeros((2, self.config.time_steps), dtype=np.float32)
        delay = max(1, int(self._rollouts.delays.max()))
        self._sent = SentCommands(max(_SMOOTHED, delay), self.config.model_dt)
        self._under_way = self._sent.latest(delay)
        self._last: tuple[float, float] | None = None
        self._noise.reset()

    def _look(self, now: Situation) -> Scene:
        local = self._handler.local_around(now.pose, now.costmap, now.at)
        grid, limits = now.grid, limits_of(self.config, self._limit)
        to_grid = now.at_grid @ now.pose.inverse()
        points = to_grid.apply(local.poses[:, :2])
        path = np.array([points[:, 0], points[:, 1], local.poses[:, 2] + to_grid.yaw], dtype=np.float32)
        step = np.hypot(*np.diff(points, axis=0).T) if len(points) > 1 else np.zeros(0)
        near_goal = local.ends_at_goal and local.length < self.config.CostCritic.near_goal_distance
        v, w = expected_speed(self.config, now.velocity, self._last, now.dt)
        return Scene(
            start=np.array([*to_grid.apply(now.pose[:2]), now.at.yaw, v, w], dtype=np.float32),
            path=path,
            along=np.concatenate([[0.0], np.cumsum(step)]).astype(np.float32),
            valid=free_points(grid, points + grid.origin),
            local=local,
            limits=limits,
            ground=Ground(
                costs=grid.costs,
                per_metre=np.float32(1.0 / grid.resolution),
                tables=self._tables(
                    grid.inscribed_radius, grid.cost_scaling_factor, near_goal, float(limits.vx_max)
                ),
                cover=self._cover.on(grid),
            ),
            costmap=grid,
            to_grid=to_grid,
        )

    # Optimization

    def _optimize(self, scene: Scene, dt: float) -> bool:
        """Improve the controls; return False if nothing is left that does not collide."""
        pursuit = self._pursuit(scene)
        for _ in range(self.config.iteration_count):
            noise = self._noise.draw()
            noise[:, :, 0] = 0.0
            noise[:, :, 1] = -self._mean
            noise[:, :, 2] = pursuit - self._mean
            self._rollouts.simulate(scene, noise, self._mean, self._under_way)
            if self._rollouts.batch.hit.all():
                return False
            at = self._rollouts.score(scene, noise, self._mean)
            self.carrot = float(scene.local.poses[at, 0]), float(scene.local.poses[at, 1])
            before = self._mean.copy()
            config = self.config
            best = controls.average(
                noise,
                self._mean,
                self._rollouts.total,
                self._noise.gains,
                np.float32(config.temperature),
                _EXACT,
            )
            self._smooth()
            self._constrain(scene, dt)
            if self._collides(scene):
                # The average of left and right is the middle: then the best one drives, as it is.
                self._mean = before + noise[:, :, best]
                self._constrain(scene, dt)
                if self._collides(scene):
                    return False
        return True

    def _pursuit(self, scene: Scene) -> F32:
        written = np.zeros_like(self._mean)
        pursue(
            scene.path,
            scene.along,
            scene.start,
            scene.limits,
            np.float32(self.config.model_dt),
            scene.ground,
            scene.local.reversing and self.reverses,
            written,
        )
        return written

    # The controls

    def _smooth(self) -> None:
        """Filter the controls; what was sent before them is their past (Nav2's savitskyGolayFilter)."""
        if self.config.time_steps > 20:
            controls.smooth(self._mean, self._sent.latest(_SMOOTHED), _FILTERS[self.config.sgf_order])

    def _constrain(self, scene: Scene, dt: float) -> None:
        model_dt = np.float32(self.config.model_dt)
        controls.constrain(self._mean, scene.start, scene.limits, np.float32(dt), model_dt)
        controls.simulate(
            self._mean, self._under_way, self._rollouts.delays, scene.start, model_dt, self._leads
        )

    def _collides(self, scene: Scene) -> bool:
        steps = math.ceil(self.config.collision_lookahead_time / self.config.model_dt)
        return bool(controls.first_collision(self._leads, scene.ground, steps) >= 0)

    def _remember(self, command: tuple[float, float], dt: float) -> None:
        self._last = command
        self._sent.add(command, dt)
        self._under_way = self._sent.latest(self._under_way.shape[1])

    def _shift(self, dt: float) -> None:
        """Move the controls on by one control period; Nav2 asks for a period of model_dt for that."""
        if abs(dt - self.config.model_dt) < 1e-6:
            self._mean[:, :-1] = self._mean[:, 1:]
            return
        steps = np.arange(self.config.time_steps, dtype=np.float64)
        at = np.minimum(steps + dt / self.config.model_dt, steps[-1])
        self._mean = np.stack([np.interp(at, steps, axis) for axis in self._mean]).astype(np.float32)
