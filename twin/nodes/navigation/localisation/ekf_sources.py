"""What `/ekf_filter_node` listens to, as measurements of its states; names are robot_localization's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from twin.bridge.conversions import pose3_from_pose
from twin.bridge.msgs import (
    Imu,
    Odometry,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
)
from twin.bridge.tf import TransformBuffer, TransformError
from twin.geometry import Array, Pose2, Pose3, matrix_from_quat_wxyz, rpy_from_quat_wxyz
from twin.navigation.localisation import ekf as states
from twin.navigation.localisation.gyro_bias import GyroBias
from twin.nodes.navigation.localisation.ekf_config import EkfSource

KINDS: dict[str, type[Any]] = {
    "odom": Odometry,
    "pose": PoseWithCovarianceStamped,
    "twist": TwistWithCovarianceStamped,
    "imu": Imu,
}
"""Message types by the beginning of a source's name: `odom0`, `imu1`."""
_GRAVITY = 9.80665
_SAME = Pose3.from_pose2(Pose2(0.0, 0.0, 0.0))


class Measurement(NamedTuple):
    """Some states, as measured."""

    states: list[int]
    values: Array
    covariance: Array
    threshold: float


class SourceReader:
    """Reads the messages of one source into measurements in the filter's frames."""

    def __init__(
        self, source: EkfSource, buffer: TransformBuffer, bias: GyroBias, *, world_frame: str, base: str
    ) -> None:
        self.source = source
        self.bias = bias
        self._buffer = buffer
        self._world_frame, self._base = world_frame, base
        self._first: Pose3 | None = None
        self._before: tuple[int, Pose3] | None = None
        self._turned = False

    @property
    def believes_gyroscope(self) -> bool:
        """Whether a gyroscope told it the turn rate about the vertical, with a bias to be learnt."""
        return self.source.estimate_bias and self.source.config[states.VYAW] and self._turned

    def read(self, message: Any, stamp_ns: int, attitude: Array) -> Iterator[Measurement]:
        """Yield what a message measures; nothing where a transform is not known.

        Args:
            message: Of the source's type.
            stamp_ns: Its stamp [ns].
            attitude: The filter's roll, pitch and yaw [rad], to take gravity off accelerations.
        """
        frame = message.header.frame_id
        if isinstance(message, Imu):
            yield from self._imu(message, stamp_ns, attitude)
        elif isinstance(message, TwistWithCovarianceStamped):
            yield from self._twist(message.twist, frame)
        elif isinstance(message, PoseWithCovarianceStamped):
            yield from self._pose(message.pose, frame, stamp_ns)
        else:
            yield from self._pose(message.pose, frame, stamp_ns)
            yield from self._twist(message.twist, message.child_frame_id)

    def reset(self) -> None:
        """Forget the poses before: the filter's was set."""
        self._first = self._before = None

    def _pose(self, message: PoseWithCovariance, frame: str, stamp_ns: int) -> Iterator[Measurement]:
        if any(self.source.config[:6]) and (T := self._transform(self._world_frame, frame)) is not None:
            pose, R = T @ pose3_from_pose(message.pose), matrix_from_quat_wxyz(T.quat_wxyz)
            yield from self._located(pose, _turned(message.covariance, R), stamp_ns, states.X)

    def _located(self, pose: Pose3, covariance: Array, stamp_ns: int, first: int) -> Iterator[Measurement]:
        """Yield a pose as it is, from the first one on, or as a velocity; from the state `first` on."""
        source = self.source
        chosen = [i for i in range(first, 6) if source.config[i]]
        if source.differential:
            before, self._before = self._before, (stamp_ns, pose)
            if before is None or stamp_ns <= before[0]:
                return
            elapsed, step = (stamp_ns - before[0]) * 1e-9, before[1].inverse() @ pose
            R = matrix_from_quat_wxyz(pose.quat_wxyz).T
            values = _vector(step) / elapsed
            spread = _turned(covariance, R) / elapsed
            yield from self._chosen(chosen, 6, values, spread, source.twist_rejection_threshold)
            return
        if source.relative:
            self._first = self._first or pose
            pose = self._first.inverse() @ pose
        yield from self._chosen(chosen, 0, _vector(pose), covariance, source.pose_rejection_threshold)

    def _twist(self, message: TwistWithCovariance, frame: str) -> Iterator[Measurement]:
        if not any(self.source.config[6:12]) or (T := self._transform(self._base, frame)) is None:
            return
        linear, angular = message.twist.linear, message.twist.angular
        R = matrix_from_quat_wxyz(T.quat_wxyz)
        rates = R @ [angular.x, angular.y, angular.z]
        # What is not where the base is moves differently in a turn.
        velocity = R @ [linear.x, linear.y, linear.z] - np.cross(rates, T.xyz)
        chosen = [i for i in range(6) if self.source.config[6 + i]]
        values = np.concatenate([velocity, rates])
        covariance, threshold = _turned(message.covariance, R), self.source.twist_rejection_threshold
        yield from self._chosen(chosen, 6, values, covariance, threshold)

    def _imu(self, message: Imu, stamp_ns: int, attitude: Array) -> Iterator[Measurement]:
        source, T = self.source, self._transform(self._base, message.header.frame_id)
        if T is None:
            return
        R = matrix_from_quat_wxyz(T.quat_wxyz)
        q, w, a = message.orientation, message.angular_velocity, message.linear_acceleration
        if any(source.config[3:6]) and message.orientation_covariance[0] >= 0.0:  # -1: not measured
            measured = Pose3(np.zeros(3), np.array([q.w, q.x, q.y, q.z]))
            level = measured @ Pose3(np.zeros(3), T.quat_wxyz).inverse()
            spread = np.zeros((6, 6))
            spread[3:, 3:] = message.orientation_covariance.reshape(3, 3)
            yield from self._located(level, spread, stamp_ns, states.ROLL)
        rates = np.array([w.x, w.y, w.z])
        self._turned = True
        if source.estimate_bias:
            rates = self.bias.corrected(rates, stamp_ns * 1e-9)
        force = R @ [a.x, a.y, a.z]
        if source.remove_gravitational_acceleration:
            force = force - states.rotation(*attitude).T @ [0.0, 0.0, _GRAVITY]
        of_rates, of_force = message.angular_velocity_covariance, message.linear_acceleration_covariance
        for first, values, covariance, threshold in (
            (states.VROLL, R @ rates, of_rates, source.twist_rejection_threshold),
            (states.AX, force, of_force, source.linear_acceleration_rejection_threshold),
        ):
            if covariance[0] >= 0.0:
                chosen = [i for i in range(3) if source.config[first + i]]
                yield from self._chosen(chosen, first, values, R @ covariance.reshape(3, 3) @ R.T, threshold)

    def _chosen(
        self, chosen: list[int], first: int, values: Array, covariance: Array, threshold: float
    ) -> Iterator[Measurement]:
        if chosen:
            measured = [first + i for i in chosen]
            yield Measurement(measured, values[chosen], covariance[np.ix_(chosen, chosen)], threshold)

    def _transform(self, target: str, source: str) -> Pose3 | None:
        if source in ("", target):
            return _SAME
        try:
            return self._buffer.lookup(target, source)
        except TransformError:
            return None


def _vector(pose: Pose3) -> Array:
    return np.concatenate([pose.xyz, rpy_from_quat_wxyz(pose.quat_wxyz)])


def _turned(covariance: ArrayLike, R: Array) -> Array:
    """Return a covariance of a position and angles, shape (36,) or (6, 6), in a frame turned by R."""
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = R
    return np.asarray(both @ np.reshape(covariance, (6, 6)) @ both.T)
