"""Sampling of commands, after Nav2's DWB and the dynamic window approach (Fox, Burgard, Thrun 1997).

Every pair of speeds that can be reached within `sim_time` is driven ahead with the drive's accelerations; the
critics score where that ends, and the best pair is the command. Distances to the path and to its end are
exact ones, not counted in cells as by Nav2, so that small errors are steered out too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2, wrap_angles
from twin.navigation.control.dwb import kernels
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.dwb.oscillation import Oscillation
from twin.navigation.control.footprint_cover import FootprintCover
from twin.navigation.control.path_handler import LocalPath, PathHandler, PathHandlerConfig
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.failures import NoValidControl

_NO_COSTMAP = Costmap(costs=np.zeros((1, 1), dtype=np.uint8), resolution=1.0)


@dataclass(kw_only=True)
class DWB:
    """Follows one path at a time; a new path array starts it over."""

    config: DWBConfig
    footprint: Array = field(default_factory=lambda: np.zeros((1, 2)))
    """Shape (n, 2) [m]; the single corner (0, 0) checks the centre for inscribed cost instead."""
    carrot: tuple[float, float] | None = field(init=False, default=None)
    """The end of the local path, in the path's frame [m]."""
    trajectory: Array | None = field(init=False, default=None)
    """Present pose and end of the best sample, in the path's frame: shape (2, 3)."""
    candidates: None = field(init=False, default=None)
    """It shows none."""

    def __post_init__(self) -> None:
        self.footprint = np.array(self.footprint, dtype=np.float64, order="C")
        self._tolerance = 0.25
        self.configure(self.config)

    @property
    def max_speed(self) -> float:
        """max_vel_x [m/s]."""
        return self.config.max_vel_x

    @property
    def reverses(self) -> bool:
        """Whether it drives backwards."""
        return self.config.enforce_path_inversion and self.config.min_vel_x < 0.0

    def configure(self, config: DWBConfig) -> None:
        """Go on with other parameters; lifts the speed limit."""
        self.config = config
        self._limit: float | None = None
        self._oscillation = Oscillation(config=config.Oscillation)
        self._handler = PathHandler(
            config=PathHandlerConfig(
                prune_distance=config.prune_distance, enforce_path_inversion=self.reverses
            )
        )
        self.reset()

    def reset(self) -> None:
        """Forget the path."""
        self._handler.reset()
        self._oscillation.reset()
        self._at_goal = self._rotating = False
        self.carrot, self.trajectory = None, None

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than `limit` [m/s]; None lifts the limit."""
        self._limit = limit

    def set_goal_tolerance(self, xy: float) -> None:
        """Stop and turn within this distance of the goal [m] (RotateToGoal)."""
        self._tolerance = xy

    def cancel(self) -> bool:
        """Return True: there is nothing to bring to an end."""
        return True

    def compute_velocity(
        self,
        pose: Pose2,
        velocity: tuple[float, float],
        path: Array,
        costmap: Costmap | None,
        dt: float,
        *,
        costmap_pose: Pose2 | None = None,
    ) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]); see `Controller.compute_velocity`.

        Raises:
            InvalidPath: the path is empty, not finite or not of shape (n, 3).
            NoValidControl: every sample collides or is forbidden.
        """
        if self._handler.accept(path):
            self._at_goal = self._rotating = False
        local = self._handler.local(pose)
        self._note_goal(pose, velocity, local)
        samples = self._samples(velocity, local)
        raw, legal, ends = self._drive(samples, pose, velocity, local, costmap, costmap_pose or pose)
        score = self._score(samples, raw, legal, ends, pose, velocity, local)
        best = int(np.argmin(score))
        if not math.isfinite(score[best]):
            raise NoValidControl(f"all {len(samples)} samples of DWB collide or are forbidden")
        command = float(samples[best, 0]), float(samples[best, 1])
        self._oscillation.note(command, pose, dt)
        self.carrot = float(local.poses[-1, 0]), float(local.poses[-1, 1])
        end = Pose2(*pose) @ Pose2(*ends[best].tolist())
        self.trajectory = np.array([pose, end])
        return command

    def _note_goal(self, pose: Pose2, velocity: tuple[float, float], local: LocalPath) -> None:
        goal = Pose2(*local.poses[-1].tolist())
        self._at_goal |= local.ends_at_goal and pose.distance(goal) <= self._tolerance
        self._rotating |= (
            self._at_goal and abs(velocity[0]) <= self.config.RotateToGoal.trans_stopped_velocity
        )

    def _samples(self, velocity: tuple[float, float], local: LocalPath) -> Array:
        """Return the commands to try, shape (n, 2): what `sim_time` suffices for."""
        config, horizon = self.config, self.config.sim_time
        v, w = velocity
        most = config.max_vel_x if self._limit is None else min(config.max_vel_x, self._limit)
        # Faster than twice the rest of the path is no help: samples lie closer before the goal.
        most = min(most, 2.0 * local.length / horizon + 0.05)
        fastest = min(most, v + config.acc_lim_x * horizon)
        slowest = max(min(config.min_vel_x, most), v + config.decel_lim_x * horizon)
        left = min(config.max_vel_theta, w + config.acc_lim_theta * horizon)
        right = max(-config.max_vel_theta, w + config.decel_lim_theta * horizon)
        forward = _with_zero(min(slowest, fastest), fastest, config.vx_samples)
        turns = _with_zero(min(right, left), left, config.vtheta_samples)
        grid = np.stack(np.meshgrid(forward, turns, indexing="ij"), axis=-1).reshape(-1, 2)
        slow = (np.abs(grid[:, 0]) < config.min_speed_xy) & (np.abs(grid[:, 1]) < config.min_speed_theta)
        return grid[~slow] if not slow.all() else grid

    def _drive(
        self,
        samples: Array,
        pose: Pose2,
        velocity: tuple[float, float],
        local: LocalPath,
        costmap: Costmap | None,
        at: Pose2,
    ) -> tuple[Array, NDArray[np.bool_], Array]:
        """Return raw scores, which samples are free of collisions, and where they end in the base frame."""
        config, grid = self.config, costmap or _NO_COSTMAP
        to_grid = Pose2(at.x - grid.origin[0], at.y - grid.origin[1], at.yaw)
        path = to_grid.apply(pose.inverse().apply(local.poses[:, :2]))
        outline = "ObstacleFootprint" in config.critics
        cover = FootprintCover.of(self.footprint, grid, consider_footprint=outline)
        goal, ahead = path[-1], config.GoalAlign.forward_point_distance
        bearing = math.atan2(goal[1] - to_grid.y, goal[0] - to_grid.x)
        nose = goal + ahead * np.array([math.cos(bearing), math.sin(bearing)])
        raw = np.zeros((len(samples), kernels.TERM_COUNT))
        legal = np.ones(len(samples), dtype=np.bool_)
        ends = np.zeros((len(samples), 3))
        kernels.drive_all(
            samples,
            np.array([*to_grid, *velocity]),
            np.array([config.acc_lim_x, -config.decel_lim_x, config.acc_lim_theta, -config.decel_lim_theta]),
            config.sim_time,
            np.array([config.linear_granularity, config.angular_granularity]),
            grid.costs,
            1.0 / grid.resolution,
            np.array([int(len(cover.outline) > 0), *cover.costs]),
            cover.circles,
            cover.outline,
            np.ascontiguousarray(path.T),
            np.array([*goal, *nose]),
            np.array([config.PathAlign.forward_point_distance, ahead]),
            raw,
            legal,
            ends,
        )
        ends[:, :2] = to_grid.inverse().apply(ends[:, :2])
        ends[:, 2] -= to_grid.yaw
        return raw, legal, ends

    def _score(
        self,
        samples: Array,
        raw: Array,
        legal: NDArray[np.bool_],
        ends: Array,
        pose: Pose2,
        velocity: tuple[float, float],
        local: LocalPath,
    ) -> Array:
        """Return the totals, shape (n); infinite for samples that are not allowed."""
        config, listed = self.config, self.config.critics
        near = pose.distance(Pose2(*local.poses[-1].tolist())) <= config.PathAlign.forward_point_distance
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
                summed = getattr(critic, "sum_scores", False)
                total += factor * critic.scale * raw[:, kernels.FOOTPRINT if summed else column]
        if "RotateToGoal" in listed and self._at_goal:
            allowed, score = self._rotate_to_goal(samples, ends, pose, velocity, local)
            total += score
            legal = legal & allowed
        if "Oscillation" in listed:
            legal = legal & self._oscillation.allowed(samples)
        total[~legal] = math.inf
        return total

    def _rotate_to_goal(
        self, samples: Array, ends: Array, pose: Pose2, velocity: tuple[float, float], local: LocalPath
    ) -> tuple[NDArray[np.bool_], Array]:
        """Return which samples may be driven at the goal, and their scores."""
        critic = self.config.RotateToGoal
        turned = ends[:, 2] if critic.lookahead_time < 0.0 else samples[:, 1] * critic.lookahead_time
        off = np.abs(wrap_angles(float(local.poses[-1, 2]) - pose.yaw - turned))
        if self._rotating:
            return samples[:, 0] == 0.0, critic.scale * off
        slower = np.abs(samples[:, 0]) < abs(velocity[0])
        return slower, critic.scale * (samples[:, 0] ** 2 * critic.slowing_factor + off)


def _with_zero(low: float, high: float, count: int) -> Array:
    """Return `count` speeds from low to high, and 0 if it lies between."""
    speeds = np.linspace(low, high, max(2, count))
    if low < 0.0 < high:
        speeds = np.union1d(speeds, [0.0])
    return speeds
