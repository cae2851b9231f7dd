"""Model predictive path integral control, as nav2_mppi_controller has it.

Williams, Drews, Goldfain, Rehg, Theodorou: Information-theoretic model predictive control, T-RO 2018. Every
cycle simulates `batch_size` noisy copies of the present controls, scores them with the critics, and moves the
controls by the noise that did well. What Nav2 does differently is named where it is.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.control.footprint_cover import FootprintCover
from twin.navigation.control.mppi import kernels
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.kernels import F32
from twin.navigation.control.mppi.noise import NoiseBank
from twin.navigation.control.mppi.scoring import cost_tables, total
from twin.navigation.control.path_handler import LocalPath, PathHandler, PathHandlerConfig
from twin.navigation.costmaps.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION, Costmap
from twin.navigation.failures import NoValidControl

_EXACT = 2
"""The first rollouts have no noise: one keeps the controls as they are, one brakes."""
_FILTERS = {
    1: np.full(9, 1.0 / 9.0, dtype=np.float32),
    2: (np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21]) / 231.0).astype(np.float32),
}
"""Savitzky-Golay, by order."""
_NO_COSTMAP = Costmap(costs=np.zeros((1, 1), dtype=np.uint8), resolution=1.0)


@dataclass(frozen=True, kw_only=True)
class _Scene:
    """What one command is computed from, in metres from the costmap's corner."""

    start: F32
    """x, y, yaw, v, w."""
    path: F32
    """Shape (3, n)."""
    along: F32
    """Distance along it, shape (n) [m]."""
    valid: np.ndarray
    """Which of its poses are free, shape (n)."""
    local: LocalPath
    costmap: Costmap
    cover: FootprintCover


@dataclass(kw_only=True)
class MPPI:
    """Follows one path at a time; a new path array goes on with the controls it has."""

    config: MPPIConfig
    footprint: Array = field(default_factory=lambda: np.zeros((1, 2)))
    """Shape (n, 2) [m]; the single corner (0, 0) checks the centre for inscribed cost instead."""
    carrot: tuple[float, float] | None = field(init=False, default=None)
    """The pose of the path that the rollouts are drawn to, in the path's frame [m]."""
    trajectory: Array | None = field(init=False, default=None)
    """What the last command is the beginning of, in the path's frame: shape (time_steps, 3)."""

    def __post_init__(self) -> None:
        self.footprint = np.array(self.footprint, dtype=np.float64, order="C")
        self.configure(self.config)

    @property
    def max_speed(self) -> float:
        """vx_max [m/s]."""
        return self.config.vx_max

    @property
    def reverses(self) -> bool:
        """Whether it drives backwards."""
        return self.config.enforce_path_inversion and self.config.vx_min < 0.0

    def configure(self, config: MPPIConfig) -> None:
        """Go on with other parameters, from rest; lifts the speed limit."""
        self.config = config
        self._noise = NoiseBank(config)
        self._limit: float | None = None
        steps, batch = config.time_steps, config.batch_size
        self._state = np.zeros((8, batch), dtype=np.float32)
        self._points = np.zeros((3, steps, batch), dtype=np.float32)
        self._raw = np.zeros((kernels.CRITIC_COUNT, batch), dtype=np.float32)
        self._hit = np.zeros(batch, dtype=np.uint8)
        self._total = np.zeros(batch, dtype=np.float32)
        self._leads = np.zeros((steps, 3))
        self._delays = np.array(
            [round(config.model_delay_vx / config.model_dt), round(config.model_delay_wz / config.model_dt)]
        )
        self._cover: tuple[tuple[float, ...], FootprintCover] | None = None
        self._handler = PathHandler(
            config=PathHandlerConfig(
                prune_distance=config.prune_distance,
                max_robot_pose_search_dist=config.max_robot_pose_search_dist,
                enforce_path_inversion=self.reverses,
                inversion_xy_tolerance=config.inversion_xy_tolerance,
                inversion_yaw_tolerance=config.inversion_yaw_tolerance,
            )
        )
        self.reset()

    def reset(self) -> None:
        """Forget the path, and the controls found for it."""
        self._handler.reset()
        self.carrot, self.trajectory = None, None
        self._forget_controls()

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than `limit` [m/s]; None lifts the limit. As in Nav2, turning is slowed as much."""
        self._limit = limit

    def set_goal_tolerance(self, xy: float) -> None:
        """Ignore it: the critics of the goal draw to its middle."""

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
            NoValidControl: every rollout collides, also after a start from rest.
        """
        self._handler.accept(path)
        scene = self._scene(pose, velocity, costmap, costmap_pose or pose, dt)
        for _ in range(self.config.retry_attempt_limit + 1):
            if self._optimize(scene, dt):
                break
            self._forget_controls()
        else:
            self.trajectory = None
            raise NoValidControl(f"all {self.config.batch_size} rollouts of MPPI collide")
        command = float(self._mean[0, 0]), float(self._mean[1, 0])
        self._remember(command)
        self.trajectory = self._in_path_frame(self._leads, pose, costmap_pose or pose, scene)
        self._shift(dt)
        return command

    # Preparation

    def _forget_controls(self) -> None:
        self._mean = np.zeros((2, self.config.time_steps), dtype=np.float32)
        self._sent = deque([(0.0, 0.0)] * 4, maxlen=4)
        self._under_way = np.zeros((2, max(1, int(self._delays.max()))), dtype=np.float32)
        self._last: tuple[float, float] | None = None
        self._noise.reset()

    @property
    def _limits(self) -> F32:
        """vx_max, vx_min, wz_max, ax_max, ax_min, az_max, least turning radius."""
        config = self.config
        ratio = 1.0 if self._limit is None else min(1.0, max(0.0, self._limit) / config.vx_max)
        radius = config.min_turning_r if config.motion_model == "Ackermann" else 0.0
        speeds = [config.vx_max * ratio, config.vx_min * ratio, config.wz_max * ratio]
        return np.array([*speeds, config.ax_max, config.ax_min, config.az_max, radius], dtype=np.float32)

    def _scene(
        self, pose: Pose2, velocity: tuple[float, float], costmap: Costmap | None, at: Pose2, dt: float
    ) -> _Scene:
        local = self._handler.local(pose)
        grid = costmap or _NO_COSTMAP
        to_grid = Pose2(at.x - grid.origin[0], at.y - grid.origin[1], at.yaw)
        turn = wrap_angle(at.yaw - pose.yaw)
        points = to_grid.apply(pose.inverse().apply(local.poses[:, :2]))
        path = np.array([points[:, 0], points[:, 1], local.poses[:, 2] + turn], dtype=np.float32)
        step = np.hypot(*np.diff(points, axis=0).T) if len(points) > 1 else np.zeros(0)
        v, w = self._expected(velocity, dt)
        return _Scene(
            start=np.array([*to_grid, v, w], dtype=np.float32),
            path=path,
            along=np.concatenate([[0.0], np.cumsum(step)]).astype(np.float32),
            valid=_free(grid, points),
            local=local,
            costmap=grid,
            cover=self._cover_for(grid),
        )

    def _expected(self, velocity: tuple[float, float], dt: float) -> tuple[float, float]:
        """Return the speed one period from now: towards the last command, as far as the limits let it."""
        config = self.config
        if self._last is None:
            return velocity
        if config.open_loop:
            return self._last
        v = min(max(self._last[0], velocity[0] + dt * config.ax_min), velocity[0] + dt * config.ax_max)
        w = min(max(self._last[1], velocity[1] - dt * config.az_max), velocity[1] + dt * config.az_max)
        return v, w

    def _cover_for(self, costmap: Costmap) -> FootprintCover:
        key = (costmap.resolution, costmap.inscribed_radius, costmap.cost_scaling_factor)
        if self._cover is None or self._cover[0] != key:
            critic = self.config.CostCritic
            self._cover = (
                key,
                FootprintCover.of(
                    self.footprint,
                    costmap,
                    consider_footprint=critic.consider_footprint,
                    padding=critic.footprint_padding,
                ),
            )
        return self._cover[1]

    # Optimization

    def _optimize(self, scene: _Scene, dt: float) -> bool:
        """Improve the controls; return False if nothing is left that does not collide."""
        for _ in range(self.config.iteration_count):
            noise = self._noise.draw()
            noise[:, :, 0] = 0.0
            noise[:, :, 1] = -self._mean
            self._roll_out(scene, noise)
            if self._hit.all():
                return False
            self._score(scene)
            before = self._mean.copy()
            config = self.config
            best = kernels.average(
                noise, self._mean, self._total, self._noise.gains, np.float32(config.temperature), _EXACT
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

    def _roll_out(self, scene: _Scene, noise: F32) -> None:
        config, local = self.config, scene.local
        limits = self._limits
        goal, angle = config.GoalCritic, config.GoalAngleCritic
        near = [
            config.scores("GoalCritic") and local.length <= goal.threshold_to_consider,
            config.scores("GoalAngleCritic") and local.length <= angle.threshold_to_consider,
            angle.symmetric_yaw_tolerance,
        ]
        dead = config.VelocityDeadbandCritic.deadband_velocities
        if not config.scores("VelocityDeadbandCritic"):
            dead = (0.0, 0.0, 0.0)
        near_goal = local.ends_at_goal and local.length < config.CostCritic.near_goal_distance
        kernels.roll_out(
            noise,
            self._mean,
            self._under_way,
            self._delays,
            scene.start,
            limits,
            np.float32(config.model_dt),
            scene.costmap.costs,
            np.float32(1.0 / scene.costmap.resolution),
            cost_tables(config, scene.costmap, near_goal=near_goal, vx_max=float(limits[0])),
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
            self._hit,
        )

    def _score(self, scene: _Scene) -> None:
        config, length = self.config, scene.local.length
        stride = max(1, config.batch_size // 256)
        furthest = kernels.furthest_reached(self._state, scene.path, scene.along, stride)
        active = {
            "GoalCritic": length <= config.GoalCritic.threshold_to_consider,
            "GoalAngleCritic": length <= config.GoalAngleCritic.threshold_to_consider,
            "PathAlignCritic": self._align(scene, furthest),
            "PathFollowCritic": self._follow(scene, furthest),
            "PathAngleCritic": self._angle(scene, furthest),
            "PreferForwardCritic": length >= config.PreferForwardCritic.threshold_to_consider
            and not scene.local.reversing,
        }
        total(config, self._raw, self._hit, active, self._total)

    def _align(self, scene: _Scene, furthest: int) -> bool:
        critic = self.config.PathAlignCritic
        if (
            not self.config.scores("PathAlignCritic")
            or scene.local.length < critic.threshold_to_consider
            or furthest < max(1, critic.offset_from_furthest)
        ):
            return False
        blocked = np.cumsum(~scene.valid[:furthest])
        if blocked[-1] > 2 and blocked[-1] / furthest > critic.max_path_occupancy_ratio:
            return False
        kernels.align_to_path(
            self._points,
            scene.start,
            scene.path,
            scene.along,
            scene.valid,
            furthest,
            critic.trajectory_point_step,
            critic.use_path_orientations,
            self._raw,
        )
        return True

    def _follow(self, scene: _Scene, furthest: int) -> bool:
        critic = self.config.PathFollowCritic
        last = len(scene.along) - 1
        at = min(furthest + critic.offset_from_furthest, last)
        while at < last and not scene.valid[at]:
            at += 1
        self.carrot = float(scene.local.poses[at, 0]), float(scene.local.poses[at, 1])
        if scene.local.length < critic.threshold_to_consider:
            return False
        x, y = scene.path[:2, at]
        np.hypot(self._state[kernels.X] - x, self._state[kernels.Y] - y, out=self._raw[kernels.FOLLOW])
        if at == last:
            # Being at the end in time is not enough: the robot would put off to go there, again and again.
            self._raw[kernels.FOLLOW] += self._raw[kernels.LAG]
        return True

    def _angle(self, scene: _Scene, furthest: int) -> bool:
        critic = self.config.PathAngleCritic
        if not self.config.scores("PathAngleCritic") or scene.local.length < critic.threshold_to_consider:
            return False
        at = min(furthest + critic.offset_from_furthest, len(scene.along) - 1)
        x, y, path_yaw = (float(value) for value in scene.path[:, at])
        x0, y0, yaw0 = (float(value) for value in scene.start[:3])
        mode = critic.mode if self.config.vx_min < 0.0 or critic.mode != 1 else 0
        if _off_heading(math.atan2(y - y0, x - x0), yaw0, path_yaw, mode) < critic.max_angle_to_furthest:
            return False
        yaws = self._state[kernels.YAW]
        bearing = np.arctan2(y - self._state[kernels.Y], x - self._state[kernels.X])
        off = np.abs(_wrapped(bearing - yaws))
        if mode == 1:
            off = np.minimum(off, np.float32(math.pi) - off)
        elif mode == 2:
            backwards = np.abs(_wrapped(bearing - np.float32(path_yaw))) > math.pi / 2.0
            off = np.where(backwards, np.float32(math.pi) - off, off)
        self._raw[kernels.ANGLE] = off
        return True

    # The controls

    def _smooth(self) -> None:
        """Filter the controls; what was sent before them is their past (Nav2's savitskyGolayFilter)."""
        if self.config.time_steps <= 20:
            return
        past = np.array(self._sent, dtype=np.float32).T
        kernels.smooth(self._mean, np.ascontiguousarray(past), _FILTERS[self.config.sgf_order])

    def _constrain(self, scene: _Scene, dt: float) -> None:
        model_dt = np.float32(self.config.model_dt)
        kernels.constrain(self._mean, scene.start, self._limits, np.float32(dt), model_dt)
        kernels.simulate(self._mean, self._under_way, self._delays, scene.start, model_dt, self._leads)

    def _collides(self, scene: _Scene) -> bool:
        steps = math.ceil(self.config.collision_lookahead_time / self.config.model_dt)
        check = np.array([1, *scene.cover.costs])
        return bool(
            kernels.first_collision(
                self._leads,
                scene.costmap.costs,
                np.float32(1.0 / scene.costmap.resolution),
                check,
                scene.cover.circles,
                scene.cover.outline,
                steps,
            )
            >= 0
        )

    def _remember(self, command: tuple[float, float]) -> None:
        self._last = command
        self._sent.append(command)
        self._under_way = np.roll(self._under_way, -1, axis=1)
        self._under_way[:, -1] = command

    def _shift(self, dt: float) -> None:
        """Move the controls on by one control period; Nav2 asks for a period of model_dt for that."""
        steps = np.arange(self.config.time_steps, dtype=np.float64)
        at = np.minimum(steps + dt / self.config.model_dt, steps[-1])
        self._mean = np.stack([np.interp(at, steps, axis) for axis in self._mean]).astype(np.float32)

    def _in_path_frame(self, trajectory: Array, pose: Pose2, at: Pose2, scene: _Scene) -> Array:
        points = trajectory.copy()
        points[:, :2] = pose.apply(at.inverse().apply(points[:, :2] + scene.costmap.origin))
        points[:, 2] += pose.yaw - at.yaw
        return points


def _free(costmap: Costmap, points: Array) -> np.ndarray:
    """Return which points, shape (n, 2) from the corner [m], are neither inscribed nor lethal."""
    height, width = costmap.costs.shape
    cells = np.floor(points / costmap.resolution).astype(np.int64)
    inside = (cells >= 0).all(axis=1) & (cells[:, 0] < width) & (cells[:, 1] < height)
    costs = costmap.costs[np.where(inside, cells[:, 1], 0), np.where(inside, cells[:, 0], 0)]
    return ~inside | (costs < INSCRIBED_INFLATED_OBSTACLE) | (costs == NO_INFORMATION)


def _off_heading(bearing: float, yaw: float, path_yaw: float, mode: int) -> float:
    """Return by how much a robot looks away from a bearing; see PathAngleCriticConfig.mode."""
    off = abs(wrap_angle(bearing - yaw))
    backwards = abs(wrap_angle(bearing - path_yaw)) > math.pi / 2.0
    return min(off, math.pi - off) if mode == 1 else math.pi - off if mode == 2 and backwards else off


def _wrapped(angles: F32) -> F32:
    turn = np.float32(2.0 * math.pi)
    return angles - turn * np.floor(angles / turn + np.float32(0.5))
