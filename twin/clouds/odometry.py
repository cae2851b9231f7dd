"""Odometry from clouds: each is registered to a map of those before it, by small_gicp's voxelised GICP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.spatial.transform import Rotation

from twin.clouds.deskewing import deskewed
from twin.clouds.points import Points, coordinates, measured, transformed
from twin.errors import CloudError
from twin.geometry import Array, Pose3, matrix_from_quat_wxyz, wxyz_from_xyzw
from twin.parameters import Interval, Metres, NotNegative, Positive, Radians

_FEWEST_POINTS = 20
"""After downsampling; fewer fix no pose."""
_PASSES = 2
"""The first takes the velocity from the cloud before, the second from the first."""
_STRETCH = 40.0
"""The points of one surface are wrong together: a covariance that follows from points that are
not is this much too small, by drives over 50 m in the warehouse."""
_BLIND = np.diag((1.0, 1.0, 1.0, 0.1, 0.1, 0.1))
"""What is not known of the motion [m², rad²] where a map had to begin anew."""


@dataclass(frozen=True, kw_only=True)
class CloudOdometryConfig:
    """Parameters of the registration; those that small_gicp has are named as there."""

    downsampling_resolution: Annotated[Metres, Interval(ge=0.01, le=10.0)] = 0.2
    """A cloud is thinned to a point for each cube of this edge."""
    voxel_resolution: Annotated[Metres, Interval(ge=0.02, le=20.0)] = 0.5
    """Edge of the map's voxels, each of which holds one Gaussian."""
    num_neighbors: Annotated[int, Interval(ge=5, le=100)] = 10
    """From so many points a point's surface is told."""
    max_correspondence_distance: Annotated[Metres, Positive] = 1.0
    """A point farther from what the map has is not compared."""
    max_iterations: Annotated[int, Interval(ge=1, le=1000)] = 30
    """Steps of the optimisation."""
    min_overlap: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.3
    """A cloud of whose points a smaller share is on the map tells no pose."""
    max_unmatched: Annotated[int, Interval(ge=1, le=100_000)] = 10
    """After so many such clouds, one after another, the map begins anew."""
    keyframe_delta_trans: Annotated[Metres, NotNegative] = 0.3
    """The map takes a cloud in after so much motion ..."""
    keyframe_delta_angle: Annotated[Radians, NotNegative] = 0.2
    """... or so much turning: one that stands does not drift."""
    lru_horizon: Annotated[int, Interval(ge=1, le=1_000_000)] = 200
    """A voxel that so many such clouds have not seen is forgotten."""
    min_range: Annotated[Metres, NotNegative] = 0.5
    """Nearer points are not used: they may be the robot's own."""
    max_range: Annotated[Metres, Positive] = 100.0
    """Nor are farther ones."""


@dataclass(frozen=True, kw_only=True)
class Registered:
    """Where a cloud was measured, at the time of its last point."""

    after_s: float
    """That time, after the cloud's stamp [s]."""
    pose: Pose3
    """Of the base where the first cloud was measured."""
    covariance: Array
    """Of that: x, y, z, and rotations about these axes, shape (6, 6) [m, rad]."""
    velocity: Array
    """Since the cloud before, in the frame of the base: linear, angular, shape (6,) [m/s, rad/s]."""
    velocity_covariance: Array
    """Shape (6, 6)."""


class CloudOdometry:
    """Registers clouds, one after another; what it returns depends on nothing else.

    The motion during a cloud is taken out by the times of its points, at the velocity between its end and
    that of the cloud before. It works in one thread: small_gicp's sums depend on the order of the threads.

    Raises:
        CloudError: small_gicp is not installed.
    """

    def __init__(self, config: CloudOdometryConfig | None = None) -> None:
        try:
            import small_gicp
        except ImportError:
            raise CloudError(
                "odometry from clouds needs small_gicp, which is not installed: pip install 'twin[odometry]'"
            ) from None
        self._gicp = small_gicp
        self.config = config or CloudOdometryConfig()
        self._pose = np.eye(4)
        self._velocity = np.zeros(6)
        self._covariance = np.zeros((6, 6))
        """Of the last registration alone, in the frame of the base."""
        self._end_s: float | None = None
        self._unmatched = 0
        self._begin()

    def _begin(self) -> None:
        self._map = self._gicp.GaussianVoxelMap(self.config.voxel_resolution)
        self._map.set_lru(horizon=self.config.lru_horizon, clear_cycle=10)
        self._key: tuple[Array, Array] | None = None
        """Pose of the last cloud that the map has taken in, and its covariance."""

    def register(self, points: Points, T_base_lidar: Pose3, stamp_s: float) -> Registered | None:
        """Return where the robot was at the end of a cloud; None: the cloud does not tell.

        Args:
            points: In the frame of the lidar, with their `time` after the stamp [s], or measured at once.
            T_base_lidar: The lidar on the robot.
            stamp_s: Stamp of the cloud [s].
        """
        seen = transformed(
            _within(measured(points), self.config.min_range, self.config.max_range), T_base_lidar
        )
        last_s = float(seen["time"].max()) if "time" in (seen.dtype.names or ()) and len(seen) else 0.0
        dt = np.inf if self._end_s is None else stamp_s + last_s - self._end_s
        if dt <= 0.0:
            return None
        if len(seen) < _FEWEST_POINTS:
            self._miss(None)
            return None
        if self._key is None:
            return self._first(self._thinned(seen, last_s, self._velocity), stamp_s, last_s)
        velocity, guess = self._velocity, self._pose @ _matrix(_moved(self._velocity, dt))
        for _ in range(_PASSES):
            cloud = self._thinned(seen, last_s, velocity)
            found = self._gicp.align(
                self._map,
                cloud,
                guess,
                max_correspondence_distance=self.config.max_correspondence_distance,
                num_threads=1,
                max_iterations=self.config.max_iterations,
                translation_epsilon=1e-4,
                rotation_epsilon=1e-4,
            )
            if found.num_inliers < max(_FEWEST_POINTS, self.config.min_overlap * cloud.size()):
                self._miss(cloud)
                return None
            taken, guess = velocity, np.asarray(found.T_target_source)
            velocity = _velocity(np.linalg.inv(self._pose) @ guess, dt)
        # By how much the velocity was not what it was taken for, the points are still bent.
        bent = np.diag((0.5 * last_s * (velocity - taken)) ** 2)
        bent += np.diag((0.25 * last_s * (velocity - self._velocity)) ** 2)
        return self._matched(cloud, guess, velocity, _covariance(found) + bent, stamp_s, last_s)

    def _thinned(self, seen: Points, last_s: float, velocity: Array) -> Any:
        """Return points in the frame of the base as if all were measured when the last one was."""
        if last_s:
            seen = deskewed(seen, lambda time: _moved(velocity, time - last_s), at=last_s)
        cloud, _ = self._gicp.preprocess_points(
            coordinates(seen),
            downsampling_resolution=self.config.downsampling_resolution,
            num_neighbors=self.config.num_neighbors,
            num_threads=1,
        )
        return cloud

    def _first(self, cloud: Any, stamp_s: float, last_s: float) -> Registered:
        """Begin a map where the robot is believed to be."""
        unknown = _BLIND if self._end_s is not None else np.zeros((6, 6))
        self._map.insert(cloud, self._pose)
        self._key = self._pose, unknown
        self._end_s, self._covariance, self._velocity = stamp_s + last_s, np.zeros((6, 6)), np.zeros(6)
        # Of a velocity that was not measured nothing is known: 1 m/s and more.
        return Registered(
            after_s=last_s,
            pose=_pose3(self._pose),
            covariance=unknown,
            velocity=np.zeros(6),
            velocity_covariance=np.eye(6),
        )

    def _miss(self, cloud: Any | None) -> None:
        self._unmatched += 1
        if cloud is not None and self._unmatched >= self.config.max_unmatched:
            self._unmatched = 0
            self._begin()

    def _matched(
        self, cloud: Any, pose: Array, velocity: Array, covariance: Array, stamp_s: float, last_s: float
    ) -> Registered:
        assert self._key is not None
        assert self._end_s is not None
        end_s = stamp_s + last_s
        velocity_covariance = (self._covariance + covariance) / (end_s - self._end_s) ** 2
        self._pose, self._end_s, self._unmatched = pose, end_s, 0
        self._velocity, self._covariance = velocity, covariance
        key, known = self._key
        since = pose[:3, 3] - key[:3, 3]
        total = _carried(known, since) + _turned(covariance, pose[:3, :3])
        step = np.linalg.inv(key) @ pose
        angle = Rotation.from_matrix(step[:3, :3]).magnitude()
        far = np.linalg.norm(since) > self.config.keyframe_delta_trans
        if far or angle > self.config.keyframe_delta_angle:
            self._map.insert(cloud, pose)
            self._key = pose, total
        return Registered(
            after_s=last_s,
            pose=_pose3(pose),
            covariance=total,
            velocity=velocity,
            velocity_covariance=velocity_covariance,
        )


def _covariance(found: Any) -> Array:
    """Return that of a registration in the frame of the base: its curvature, scaled by what is left over.

    A direction in which nothing holds the robot, as along a corridor, is as uncertain as a voxel is wide.
    """
    H = np.asarray(found.H, dtype=np.float64)
    order = [3, 4, 5, 0, 1, 2]  # small_gicp has rotations first
    left = 2.0 * found.error / max(3 * found.num_inliers - 6, 1)
    scale = _STRETCH * left
    return np.linalg.inv(H[np.ix_(order, order)] / scale + np.eye(6))


def _velocity(moved: Array, dt: float) -> Array:
    """Return the velocity, shape (6,), that moves the base in `dt` [s], shape (4, 4)."""
    turned: Array = Rotation.from_matrix(moved[:3, :3]).as_rotvec()
    return np.concatenate([moved[:3, 3], turned]) / dt


def _turned(covariance: Array, rotation: Array) -> Array:
    """Return a covariance of the base's frame along the axes of the map."""
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = rotation
    return both @ covariance @ both.T


def _carried(covariance: Array, moved: Array) -> Array:
    """Return what a pose's covariance makes of one that is `moved` from it: turns become displacements."""
    x, y, z = moved
    lever = np.eye(6)
    lever[:3, 3:] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return lever @ covariance @ lever.T


def _within(points: Points, low: float, high: float) -> Points:
    ranges = np.linalg.norm(coordinates(points), axis=1)
    kept: Points = points[(ranges >= low) & (ranges <= high)]
    return kept


def _moved(velocity: Array, dt: float) -> Pose3:
    """Return where the base is `dt` [s] later, in its frame of now."""
    quat = wxyz_from_xyzw(Rotation.from_rotvec(dt * velocity[3:]).as_quat())
    return Pose3(dt * velocity[:3], quat)


def _matrix(pose: Pose3) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = matrix_from_quat_wxyz(pose.quat_wxyz), pose.xyz
    return matrix


def _pose3(matrix: Array) -> Pose3:
    quat = wxyz_from_xyzw(Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True))
    return Pose3(matrix[:3, 3].copy(), quat)
