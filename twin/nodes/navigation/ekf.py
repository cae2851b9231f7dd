"""`/ekf_filter_node`: wheels and IMU fused into `odometry/filtered`, with robot_localization's interface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
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
    ns,
)
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.tf import (
    TransformBroadcaster,
    TransformBuffer,
    TransformError,
    TransformListener,
    transform_stamped,
)
from twin.geometry import Array, Pose2, Pose3, matrix_from_quat_wxyz, quat_wxyz_from_rpy, rpy_from_quat_wxyz
from twin.navigation.localisation import ekf as states
from twin.navigation.localisation.ekf import SIZE, Ekf, EkfConfig
from twin.navigation.localisation.gyro_bias import GyroBias
from twin.nodes.node_parameters import declare_config

_GRAVITY = 9.80665
_POSE, _TWIST = range(6), range(6, 12)


def _which(*chosen: int) -> tuple[bool, ...]:
    return tuple(state in chosen for state in range(SIZE))


# Accelerations and turns of a driven robot: what it does within a tenth of a second is not foreseen.
_ON_A_FLOOR = EkfConfig(
    two_d_mode=True,
    process_noise_covariance=(
        *(1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-7),
        *(1.0, 1e-3, 1e-3, 1e-3, 1e-3, 5.0),
        *(1.0, 1.0, 1.0),
    ),
)


@dataclass(frozen=True, kw_only=True)
class EkfNodeConfig:
    """Parameters; names are robot_localization's. Defaults fit a wheeled robot with an IMU."""

    ekf: EkfConfig = _ON_A_FLOOR
    period_ns: int = 20_000_000
    """Between outputs; as `frequency` [Hz]."""
    publish_tf: bool = True
    map_frame: str = "map"
    odom_frame: str = "odom"
    base_link_frame: str = "base_footprint"
    world_frame: str = "odom"
    """Parent of the transform that is published."""
    odom0: str = "odom"
    """Topic of nav_msgs/Odometry; empty: none."""
    odom0_config: tuple[bool, ...] = _which(states.VX, states.VY, states.VYAW)
    """Which of x y z, roll pitch yaw, their velocities, and accelerations to take from it."""
    odom0_differential: bool = False
    """Whether its pose counts by its changes only."""
    odom0_relative: bool = False
    """Whether its pose counts from its first one."""
    odom0_pose_rejection_threshold: float = 1e9
    """Mahalanobis distance."""
    odom0_twist_rejection_threshold: float = 1e9
    imu0: str = "imu"
    """Topic of sensor_msgs/Imu; empty: none."""
    imu0_config: tuple[bool, ...] = _which(states.VYAW)
    imu0_remove_gravitational_acceleration: bool = True
    imu0_twist_rejection_threshold: float = 1e9
    imu0_linear_acceleration_rejection_threshold: float = 1e9
    imu0_estimate_bias: bool = True
    """Whether the gyroscope's bias is learnt while the wheels stand (robot_localization does not)."""

    def __post_init__(self) -> None:
        for name in ("odom0_config", "imu0_config"):
            if len(getattr(self, name)) != SIZE:
                raise ValueError(f"ekf_filter_node: {name} must be {SIZE} truth values")


class EkfNode:
    """Takes `odom`, `imu` and `set_pose`; publishes `odometry/filtered` and odom → base.

    Measurements are taken in at their stamps, oldest first, then the state is predicted to the present.
    """

    def __init__(self, bus: Bus, config: EkfNodeConfig | None = None, *, namespace: str = "") -> None:
        self.node = node = bus.create_node("ekf_filter_node", namespace)
        self.config = config = config or EkfNodeConfig()
        self.filter = Ekf(config.ekf)
        self.bias = GyroBias()
        self._time_ns: int | None = None
        self._waiting: list[tuple[int, int, Odometry | Imu]] = []
        self._first: Pose2 | None = None
        self._before: tuple[int, Pose2] | None = None
        declare_config(node, config, names={"ekf": ""})
        self._buffer = TransformBuffer()
        self._listener = TransformListener(self._buffer, node)
        self._tf = TransformBroadcaster(node)
        self._publisher = node.create_publisher(Odometry, "odometry/filtered", 10)
        node.create_subscription(PoseWithCovarianceStamped, "set_pose", self._on_set_pose, 1)
        if config.odom0:
            node.create_subscription(Odometry, config.odom0, self._on_measurement, 10)
        if config.imu0:
            node.create_subscription(Imu, config.imu0, self._on_measurement, SENSOR_DATA)
        node.create_timer(config.period_ns, self._update)

    def _on_measurement(self, message: Odometry | Imu) -> None:
        self._waiting.append((ns(message.header.stamp), len(self._waiting), message))

    def _on_set_pose(self, message: PoseWithCovarianceStamped) -> None:
        pose, covariance = message.pose.pose, message.pose.covariance.reshape(6, 6)
        q = pose.orientation
        vector = [pose.position.x, pose.position.y, pose.position.z]
        vector += rpy_from_quat_wxyz([q.w, q.x, q.y, q.z]).tolist()
        if not (np.all(np.isfinite(vector)) and np.all(np.isfinite(covariance))):
            self.node.get_logger().error("set_pose refused: it must be finite")
            return
        self.filter.set_pose(vector, covariance)
        self._waiting.clear()

    def _update(self) -> None:
        now = self.node.now_ns
        self._waiting.sort(key=lambda entry: entry[:2])
        for stamp_ns, _, message in self._waiting:
            self._predict(min(stamp_ns, now))
            if isinstance(message, Odometry):
                self._take_odometry(message, stamp_ns)
            else:
                self._take_imu(message, stamp_ns)
        self._waiting.clear()
        if self._time_ns is not None:
            self._predict(now)
            self._publish(now)

    def _predict(self, time_ns: int) -> None:
        if self._time_ns is not None and time_ns > self._time_ns:
            self.filter.predict((time_ns - self._time_ns) * 1e-9)
        self._time_ns = time_ns if self._time_ns is None else max(self._time_ns, time_ns)

    def _take_odometry(self, message: Odometry, stamp_ns: int) -> None:
        config, twist = self.config, message.twist.twist
        self.bias.wheels(twist.linear.x, twist.angular.z, stamp_ns * 1e-9)
        wanted = [i for i in _POSE if config.odom0_config[i]]
        if wanted:
            self._take_pose(message, wanted, stamp_ns)
        values = [
            *(twist.linear.x, twist.linear.y, twist.linear.z),
            *(twist.angular.x, twist.angular.y, twist.angular.z),
        ]
        self._correct(_TWIST, values, message.twist.covariance, config.odom0_twist_rejection_threshold)

    def _take_pose(self, message: Odometry, wanted: list[int], stamp_ns: int) -> None:
        """Take x, y and yaw of a pose as they are, from the first one on, or as a velocity."""
        config, pose = self.config, pose2_from_pose(message.pose.pose)
        covariance = message.pose.covariance.reshape(6, 6)
        planar = [i for i in wanted if i in (states.X, states.Y, states.YAW)]
        if config.odom0_differential:
            before, self._before = self._before, (stamp_ns, pose)
            if before is None or stamp_ns <= before[0]:
                return
            elapsed, step = (stamp_ns - before[0]) * 1e-9, before[1].inverse() @ pose
            values = dict(zip((states.X, states.Y, states.YAW), np.array(step) / elapsed, strict=True))
            moved = [i + 6 for i in planar]
            spread = covariance[np.ix_(planar, planar)] / elapsed
            self.filter.correct(
                moved, [values[i] for i in planar], spread, threshold=config.odom0_twist_rejection_threshold
            )
            return
        if config.odom0_relative:
            self._first = self._first or pose
            pose = self._first.inverse() @ pose
        values = dict(zip((states.X, states.Y, states.YAW), pose, strict=True))
        self.filter.correct(
            planar,
            [values[i] for i in planar],
            covariance[np.ix_(planar, planar)],
            threshold=config.odom0_pose_rejection_threshold,
        )

    def _correct(self, group: range, values: list[float], covariance: Array, threshold: float) -> None:
        """Correct with those of a group of six states that `odom0_config` asks for."""
        chosen = [i for i in group if self.config.odom0_config[i]]
        at = [i - group.start for i in chosen]
        if chosen:
            spread = covariance.reshape(6, 6)[np.ix_(at, at)]
            self.filter.correct(chosen, [values[i] for i in at], spread, threshold=threshold)

    def _take_imu(self, message: Imu, stamp_ns: int) -> None:
        config = self.config
        try:
            mount = self._buffer.lookup(config.base_link_frame, message.header.frame_id)
        except TransformError:
            return
        R = matrix_from_quat_wxyz(mount.quat_wxyz)
        w, a = message.angular_velocity, message.linear_acceleration
        rates, force = np.array([w.x, w.y, w.z]), np.array([a.x, a.y, a.z])
        if config.imu0_estimate_bias:
            rates = self.bias.corrected(rates, stamp_ns * 1e-9)
        force = R @ force
        if config.imu0_remove_gravitational_acceleration:
            force = force - states.rotation(*self.filter.state[states.ANGLES]).T @ [0.0, 0.0, _GRAVITY]
        for first, values, covariance, threshold in (
            (
                states.VROLL,
                R @ rates,
                message.angular_velocity_covariance,
                config.imu0_twist_rejection_threshold,
            ),
            (
                states.AX,
                force,
                message.linear_acceleration_covariance,
                config.imu0_linear_acceleration_rejection_threshold,
            ),
        ):
            chosen = [i for i in range(3) if config.imu0_config[first + i]]
            if chosen and covariance[0] >= 0.0:  # -1: not measured
                spread = (R @ covariance.reshape(3, 3) @ R.T)[np.ix_(chosen, chosen)]
                self.filter.correct(
                    [first + i for i in chosen], [values[i] for i in chosen], spread, threshold=threshold
                )

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
            self._tf.send_transform(
                transform_stamped(config.world_frame, config.base_link_frame, now_ns, pose)
            )


def for_robot(odom_frame: str, base_frame: str, period_ns: int, imu: str) -> EkfNodeConfig:
    """Return the defaults for a robot's frames, its control period [ns] and the topic of its IMU, or ''."""
    return replace(
        EkfNodeConfig(),
        odom_frame=odom_frame,
        world_frame=odom_frame,
        base_link_frame=base_frame,
        period_ns=period_ns,
        imu0=imu,
    )
