"""Sampling of commands, after Nav2's DWB and the dynamic window approach (Fox, Burgard, Thrun 1997).

Every pair of speeds that can be reached within `sim_time` is driven ahead with the drive's accelerations; the
critics score where that ends, and the best pair is the command. Distances to the path and to its end are
exact ones, not counted in cells as by Nav2, so that small errors are steered out too. To change sign
again and again on the spot is forbidden, as by DWB's OscillationCritic.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2, wrap_angle, wrap_angles
from twin.navigation.control.controller import Controller, Situation
from twin.navigation.control.critic import Trajectories
from twin.navigation.control.dwb import kernels
from twin.navigation.control.dwb.config import DWBConfig, ObstacleConfig, OscillationConfig
from twin.navigation.control.footprint_cover import CoverOf
from twin.navigation.control.path_handler import LocalPath, PathHandler
from twin.navigation.failures import NoValidControl
from twin.navigation.plugins import own_critics


class Oscillation:
    """After a change of sign the old sign is forbidden until the robot has got somewhere."""

    def __init__(self, config: OscillationConfig) -> None:
        self.config = config
        self.reset()

    def reset(self) -> None:
        """Forget every change."""
        self._signs = [0.0, 0.0]
        self._only = [0.0, 0.0]
        self._since: Pose2 | None = None
        self._age = 0.0

    def allowed(self, samples: Array) -> NDArray[np.bool_]:
        """Return which commands (v, w), shape (n, 2), are not forbidden."""
        only = np.array(self._only)
        against: NDArray[np.bool_] = ((samples * only) < 0.0).any(axis=1)
        return ~against

    def note(self, command: tuple[float, float], pose: Pose2, dt: float) -> None:
        """Take the command that was chosen at a pose, `dt` [s] after the last one."""
        config = self.config
        axes = (0, 1) if abs(command[0]) <= config.x_only_threshold else (0,)
        changed = False
        for axis in axes:
            sign = math.copysign(1.0, command[axis]) if command[axis] else 0.0
            if sign * self._signs[axis] < 0.0:
                self._only[axis], changed = sign, True
            self._signs[axis] = sign or self._signs[axis]
        self._age += dt
        if changed:
            self._since, self._age = pose, 0.0
        elif self._since is not None and self._moved(self._since, pose):
            self.reset()

    def _moved(self, before: Pose2, now: Pose2) -> bool:
        config = self.config
        return (
            before.distance(now) > config.oscillation_reset_dist
            or abs(wrap_angle(now.yaw - before.yaw)) > config.oscillation_reset_angle
            or 0.0 <= config.oscillation_reset_time < self._age
        )


class DWB(Controller):
    """Tries every pair of speeds within reach."""

    Config = DWBConfig
    config: DWBConfig

    @property
    def trajectory(self) -> Array | None:
        """Present pose and end of the best sample, in the path's frame: shape (2, 3)."""
        return self._trajectory

    @property
    def max_speed(self) -> float:
        """max_vel_x [m/s]."""
        return self.config.max_vel_x

    @property
    def reverses(self) -> bool:
        """Whether it drives backwards."""
        return self.config.enforce_path_inversion and self.config.min_vel_x < 0.0

    def _build(self) -> None:
        config = self.config
        self._oscillation = Oscillation(config.Oscillation)
        self._critics = own_critics(config)
        self._cover = CoverOf(self.footprint, consider_footprint="ObstacleFootprint" in config.critics)
        self._handler = PathHandler(to_cusps=self.reverses, prune_distance=config.prune_distance)

    def set_plan(self, path: Array) -> None:
        """Follow another path; see `Controller.set_plan`."""
        self._handler.accept(path)
        super().set_plan(path)
        self._at_goal = self._rotating = False

    def reset(self) -> None:
        """Forget the path."""
        super().reset()
        self._handler.reset()
        self._oscillation.reset()
        self._at_goal = self._rotating = False
        self._trajectory: Array | None = None

    def compute_velocity_commands(self, now: Situation) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]); see `Controller.compute_velocity_commands`."""
        local = self._handler.local(now.pose)
        self._note_goal(now, local)
        samples = self._samples(now.velocity, local)
        raw, legal, ends = self._drive(samples, now, local)
        score = self._score(samples, raw, legal, ends, now, local)
        best = int(np.argmin(score))
        if not math.isfinite(score[best]):
            raise NoValidControl(f"all {len(samples)} samples of DWB collide or are forbidden")
        command = float(samples[best, 0]), float(samples[best, 1])
        self._oscillation.note(command, now.pose, now.dt)
        self.carrot = float(local.poses[-1, 0]), float(local.poses[-1, 1])
        self._trajectory = np.array([now.pose, now.pose @ Pose2(*ends[best].tolist())])
        return command

    def _note_goal(self, now: Situation, local: LocalPath) -> None:
        goal = Pose2(*local.poses[-1].tolist())
        off, stopped = now.pose.distance(goal), self.config.RotateToGoal.trans_stopped_velocity
        self._at_goal = self._is_there(self._at_goal, off, at_end=local.ends_at_goal)
        self._rotating = self._at_goal and (self._rotating or abs(now.velocity[0]) <= stopped)

    def _samples(self, velocity: tuple[float, float], local: LocalPath) -> Array:
        """Return the commands to try, shape (n, 2): what `sim_time` suffices for."""
        config, horizon = self.config, self.config.sim_time
        v, w = velocity
        # Faster than twice the rest of the path is no help: samples lie closer before the goal.
        most = min(self.speed, 2.0 * local.length / horizon + 0.05)
        fastest = min(most, v + config.acc_lim_x * horizon)
        slowest = max(min(config.min_vel_x, most), -self.speed, v + config.decel_lim_x * horizon)
        left = min(config.max_vel_theta, w + config.acc_lim_theta * horizon)
        right = max(-config.max_vel_theta, w + config.decel_lim_theta * horizon)
        forward = _with_zero(min(slowest, fastest), fastest, config.vx_samples)
        turns = _with_zero(min(right, left), left, config.vtheta_samples)
        grid = np.stack(np.meshgrid(forward, turns, indexing="ij"), axis=-1).reshape(-1, 2)
        slow = (np.abs(grid[:, 0]) < config.min_speed_xy) & (np.abs(grid[:, 1]) < config.min_speed_theta)
        return grid[~slow] if not slow.all() else grid

    def _drive(
        self, samples: Array, now: Situation, local: LocalPath
    ) -> tuple[Array, NDArray[np.bool_], Array]:
        """Return raw scores, which samples are free of collisions, and where they end in the base frame."""
        config, grid, at = self.config, now.grid, now.at_grid
        path = at.apply(now.pose.inverse().apply(local.poses[:, :2]))
        goal, ahead = path[-1], config.GoalAlign.forward_point_distance
        bearing = math.atan2(goal[1] - at.y, goal[0] - at.x)
        nose = goal + ahead * np.array([math.cos(bearing), math.sin(bearing)])
        raw = np.zeros((len(samples), kernels.TERM_COUNT))
        legal = np.ones(len(samples), dtype=np.bool_)
        ends = np.zeros((len(samples), 3))
        kernels.drive_all(
            samples,
            np.array([*at, *now.velocity]),
            np.array([config.acc_lim_x, -config.decel_lim_x, config.acc_lim_theta, -config.decel_lim_theta]),
            config.sim_time,
            np.array([config.linear_granularity, config.angular_granularity]),
            grid.costs,
            1.0 / grid.resolution,
            self._cover.on(grid),
            np.ascontiguousarray(path.T),
            np.array([*goal, *nose]),
            np.array([config.PathAlign.forward_point_distance, ahead]),
            raw,
            legal,
            ends,
        )
        ends[:, :2] = at.inverse().apply(ends[:, :2])
        ends[:, 2] -= at.yaw
        return raw, legal, ends

    def _score(
        self,
        samples: Array,
        raw: Array,
        legal: NDArray[np.bool_],
        ends: Array,
        now: Situation,
        local: LocalPath,
    ) -> Array:
        """Return the totals, shape (n); infinite for samples that are not allowed."""
        config, listed = self.config, self.config.critics
        near = now.pose.distance(Pose2(*local.poses[-1].tolist())) <= config.PathAlign.forward_point_distance
        total = np.zeros(len(samples))
        for name, column, factor in (
            ("BaseObstacle", kernels.BASE, 1.0),
            ("ObstacleFootprint", kernels.BASE, 1.0),
            ("PathDist", kernels.PATH_DIST, 0.5),
            ("PathAlign", kernels.PATH_ALIGN, 0.0 if near else 0.5),
            ("GoalDist", kernels.GOAL_DIST, 0.5),
            ("GoalAlign", kernels.GOAL_ALIGN, 0.5),
            ("Twirling", kernels.TWIRLING, 1.0),
            ("PreferForward", kernels.BACKWARD, 0.0 if local.reversing else 1.0),
        ):
            critic = getattr(config, name)
            if name in listed:
                summed = isinstance(critic, ObstacleConfig) and critic.sum_scores
                total += factor * critic.scale * raw[:, kernels.FOOTPRINT if summed else column]
        if self._critics:
            trajectories = _trajectories(samples, ends, now, local)
            for critic in self._critics:
                total += critic.score(trajectories)
        if "RotateToGoal" in listed and self._at_goal:
            allowed, score = self._rotate_to_goal(samples, ends, now, local)
            total += score
            legal = legal & allowed
        if "Oscillation" in listed:
            legal = legal & self._oscillation.allowed(samples)
        total[~legal] = math.inf
        return total

    def _rotate_to_goal(
        self, samples: Array, ends: Array, now: Situation, local: LocalPath
    ) -> tuple[NDArray[np.bool_], Array]:
        """Return which samples may be driven at the goal, and their scores."""
        critic = self.config.RotateToGoal
        turned = ends[:, 2] if critic.lookahead_time < 0.0 else samples[:, 1] * critic.lookahead_time
        off = np.abs(wrap_angles(float(local.poses[-1, 2]) - now.pose.yaw - turned))
        if self._rotating:
            return samples[:, 0] == 0.0, critic.scale * off
        slower = np.abs(samples[:, 0]) < abs(now.velocity[0])
        return slower, critic.scale * (samples[:, 0] ** 2 * critic.slowing_factor + off)


def _trajectories(samples: Array, ends: Array, now: Situation, local: LocalPath) -> Trajectories:
    """Return the samples as critics of users see them: with their ends, shape (n, 3), in the base frame."""
    to_grid = now.at @ now.pose.inverse()
    return Trajectories(
        poses=np.column_stack([now.at.apply(ends[:, :2]), ends[:, 2] + now.at.yaw])[:, None, :],
        commands=samples[:, None, :],
        start=now.at,
        velocity=now.velocity,
        path=np.column_stack([to_grid.apply(local.poses[:, :2]), local.poses[:, 2] + to_grid.yaw]),
        costmap=now.grid,
    )


def _with_zero(low: float, high: float, count: int) -> Array:
    """Return `count` speeds from low to high, and 0 if it lies between."""
    speeds = np.linspace(low, high, max(2, count))
    if low < 0.0 < high:
        speeds = np.union1d(speeds, [0.0])
    return speeds
