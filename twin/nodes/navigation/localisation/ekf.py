"""`/ekf_filter_node`: wheels and IMU fused into `odometry/filtered`, with robot_localization's interface."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose3_from_pose
from twin.bridge.msgs import (
    Imu,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    new,
    ns,
)
from twin.bridge.qos import SENSOR_DATA, QoS
from twin.bridge.srvs import SetEkfPose
from twin.bridge.tf import TransformBroadcaster, TransformBuffer, TransformListener, transform_stamped
from twin.geometry import Array, Pose2, Pose3, quat_wxyz_from_rpy, rpy_from_quat_wxyz
from twin.navigation.localisation import ekf as states
from twin.navigation.localisation.ekf import Ekf
from twin.navigation.localisation.gyro_bias import GyroBias
from twin.nodes.navigation.localisation.ekf_config import EkfNodeConfig, EkfSource
from twin.nodes.navigation.localisation.ekf_sources import KINDS, Measurement, SourceReader
from twin.nodes.node_parameters import declare_config

_Taken = tuple[int, Callable[[], list[Measurement]]]
"""When something was measured [ns], and what."""


class _Moment(NamedTuple):
    """The filter when something was measured."""

    time_ns: int
    state: Array
    covariance: Array
    bias_ages_s: tuple[float, ...]
    """Of the readers."""


class EkfNode:
    """Takes `odom`, `imu` and `set_pose`; publishes `odometry/filtered` and odom → base.

    Measurements are taken in at their stamps, oldest first, then the state is predicted to the present. What
    is older than the state counts as if it were not, or, with `smooth_lagged_data`, the state of its time is
    gone on from, with all that came since.
    """

    def __init__(self, bus: Bus, config: EkfNodeConfig | None = None, *, namespace: str = "") -> None:
        self.node = node = bus.create_node("ekf_filter_node", namespace)
        self.config = config = config or EkfNodeConfig()
        self.filter = Ekf(config.ekf)
        self._time_ns: int | None = None
        self._waiting: list[tuple[int, int, SourceReader, Any]] = []
        self._past: deque[_Moment] = deque()
        self._taken: deque[tuple[int, list[Measurement]]] = deque()
        declare_config(node, config)
        self._buffer = TransformBuffer()
        self._listener = TransformListener(self._buffer, node)
        self._tf = TransformBroadcaster(node)
        self._publisher = node.create_publisher(Odometry, "odometry/filtered", 10)
        node.create_subscription(PoseWithCovarianceStamped, "set_pose", self._on_set_pose, 1)
        node.create_service(SetEkfPose, "set_pose", self._on_set_pose_request)
        self._readers: list[SourceReader] = []
        odometries = (name for name in config.sources if name.startswith("odom"))
        self._wheels = min(odometries, key=lambda name: int(name[4:]), default="")
        for name, source in config.sources.items():
            self._listen(name, source)
        node.create_timer(config.period_ns, self._update)

    @property
    def biases(self) -> list[GyroBias]:
        """What was learnt about the gyroscopes, by source."""
        return [reader.bias for reader in self._readers]

    def place(self, pose: Pose2) -> None:
        """Go on from another pose, as fast and as sure as now: it is seen from another world frame."""
        state, covariance = self.filter.state, self.filter.covariance
        turn = pose.yaw - float(state[states.YAW])
        state[[states.X, states.Y, states.YAW]] = pose
        rotation = np.eye(states.SIZE)
        rotation[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
        self.filter.covariance = rotation @ covariance @ rotation.T
        self._forget()

    def _forget(self) -> None:
        """Forget what was measured: the pose was set."""
        for kept in (self._waiting, self._past, self._taken):
            kept.clear()
        for reader in self._readers:
            reader.reset()

    def _listen(self, name: str, source: EkfSource) -> None:
        kind = KINDS[name.rstrip("0123456789")]
        reader = SourceReader(
            source,
            self._buffer,
            GyroBias(source.bias_stddev),
            world_frame=self.config.world_frame,
            base=self.config.base_link_frame,
        )
        self._readers.append(reader)

        def on_message(message: Any) -> None:
            self._waiting.append((ns(message.header.stamp), len(self._waiting), reader, message))
            if name == self._wheels:
                self._tell_wheels(message)

        qos = replace(SENSOR_DATA if kind is Imu else QoS(), depth=source.queue_size)
        self.node.create_subscription(kind, source.topic, on_message, qos, frozen=True)

    def _tell_wheels(self, message: Odometry) -> None:
        """Tell all gyroscopes what wheels do: while they stand, what is measured is bias."""
        twist = message.twist.twist
        for reader in self._readers:
            reader.bias.wheels(twist.linear.x, twist.angular.z, ns(message.header.stamp) * 1e-9)

    def _on_set_pose(self, message: PoseWithCovarianceStamped) -> None:
        pose, covariance = pose3_from_pose(message.pose.pose), message.pose.covariance.reshape(6, 6)
        vector = np.concatenate([pose.xyz, rpy_from_quat_wxyz(pose.quat_wxyz)])
        log, frame = self.node.get_logger(), message.header.frame_id
        if not (np.all(np.isfinite(vector)) and np.all(np.isfinite(covariance))):
            log.error("set_pose refused: it must be finite")
            return
        if frame not in ("", self.config.world_frame):
            log.error(f"set_pose refused: its frame is '{frame}', not '{self.config.world_frame}'")
            return
        self.filter.set_pose(vector, covariance)
        self._forget()

    def _on_set_pose_request(self, request: Any) -> object:
        self._on_set_pose(request.pose)
        return new(SetEkfPose.Response)

    def _update(self) -> None:
        now = self.node.now_ns
        if self._time_ns is not None and now < self._time_ns:  # the clock was set back
            self._time_ns = now
            self._past.clear()
            self._taken.clear()
        self._waiting.sort(key=lambda entry: entry[:2])
        due = self._back_to(self._waiting[0][0]) if self._waiting else []
        for stamp_ns, _, reader, message in self._waiting:
            due.append((stamp_ns, partial(self._read, stamp_ns, reader, message)))
        for stamp_ns, measure in sorted(due, key=lambda entry: entry[0]):
            self._predict(min(stamp_ns, now))
            found = measure()
            for one in found:
                self.filter.correct(one.states, one.values, one.covariance, threshold=one.threshold)
            self._remember(found, now)
        self._waiting.clear()
        if self._time_ns is not None:
            self._predict(now)
            self._publish(now)

    def _read(self, stamp_ns: int, reader: SourceReader, message: Any) -> list[Measurement]:
        return list(reader.read(message, stamp_ns, self.filter.state[states.ANGLES]))

    def _back_to(self, stamp_ns: int) -> list[_Taken]:
        """Be as before a time that has passed; return what was measured since, which is to be taken again.

        What is older than what is remembered moves nothing.
        """
        if self._time_ns is None or stamp_ns >= self._time_ns or not self._past:
            return []
        if stamp_ns < self._past[0].time_ns:
            return []
        while self._past[-1].time_ns > stamp_ns:
            self._past.pop()
        moment = self._past[-1]
        self._time_ns, self.filter.state, self.filter.covariance = moment[:3]
        for reader, age_s in zip(self._readers, moment.bias_ages_s, strict=True):
            reader.bias.age_s = age_s
        again: list[_Taken] = []
        while self._taken and self._taken[-1][0] > moment.time_ns:
            time_ns, found = self._taken.pop()
            again.insert(0, (time_ns, partial(list, found)))
        return again

    def _remember(self, found: list[Measurement], now: int) -> None:
        """Keep the state and what made it, as long as somebody may ask for it."""
        if not self.config.smooth_lagged_data or self._time_ns is None:
            return
        ages = tuple(reader.bias.age_s for reader in self._readers)
        state, covariance = self.filter.state.copy(), self.filter.covariance.copy()
        self._past.append(_Moment(self._time_ns, state, covariance, ages))
        self._taken.append((self._time_ns, found))
        while len(self._past) > 1 and self._past[1].time_ns <= now - self.config.history_length_ns:
            self._past.popleft()
            self._taken.popleft()

    def _predict(self, time_ns: int) -> None:
        if self._time_ns is not None and time_ns > self._time_ns:
            dt = (time_ns - self._time_ns) * 1e-9
            self.filter.predict(dt)
            drifts = [reader.bias.drift(dt) for reader in self._readers if reader.believes_gyroscope]
            self.filter.doubt(states.YAW, min(drifts, default=0.0))
        self._time_ns = time_ns if self._time_ns is None else max(self._time_ns, time_ns)

    def _publish(self, now_ns: int) -> None:
        config, state, covariance = self.config, self.filter.state, self.filter.covariance
        w, x, y, z = quat_wxyz_from_rpy(*state[states.ANGLES])
        linear, angular = state[states.VELOCITY].tolist(), state[states.RATES].tolist()
        self._publisher.publish(
            Odometry(
                header=header(now_ns, config.world_frame),
                child_frame_id=config.base_link_frame,
                pose=PoseWithCovariance(
                    pose=Pose(
                        position=Point(*state[states.POSITION].tolist()),
                        orientation=Quaternion(x=x, y=y, z=z, w=w),
                    ),
                    covariance=covariance[:6, :6].ravel(),
                ),
                twist=TwistWithCovariance(
                    twist=Twist(linear=Vector3(*linear), angular=Vector3(*angular)),
                    covariance=covariance[6:12, 6:12].ravel(),
                ),
            )
        )
        if config.publish_tf:
            pose = Pose3(state[states.POSITION].copy(), np.array([w, x, y, z]))
            stamp_ns = now_ns + config.transform_time_offset_ns
            moved = transform_stamped(config.world_frame, config.base_link_frame, stamp_ns, pose)
            self._tf.send_transform(moved, frozen=True)
