"""Parameters of `/ekf_filter_node`; names are robot_localization's."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated

from annotated_types import Len

from twin.navigation.localisation import ekf as states
from twin.navigation.localisation.ekf import SIZE, EkfConfig
from twin.parameters import (
    Derived,
    DurationNs,
    Flat,
    Interval,
    Itself,
    Le,
    NotNegative,
    PeriodNs,
    Positive,
    RadiansPerSecond,
    Underscored,
)

SOURCE = r"(odom|pose|twist|imu)\d+"
"""What sources are called: `odom0`, `imu1`."""


@dataclass(frozen=True, kw_only=True)
class EkfSource:
    """One source; of its parameters those count that its kind has.

    Raises:
        ValueError: the topic is empty, or `config` has not 15 truth values.
    """

    topic: Annotated[str, Itself]
    """Of Odometry, PoseWithCovarianceStamped, TwistWithCovarianceStamped or Imu messages."""
    config: Annotated[tuple[bool, ...], Len(SIZE, SIZE)]
    """Which of x y z, roll pitch yaw, their velocities, and accelerations to take from it."""
    differential: bool = False
    """Whether its pose counts by its changes only."""
    relative: bool = False
    """Whether its pose counts from its first one."""
    pose_rejection_threshold: Annotated[float, Positive] = 1e9
    """Mahalanobis distance beyond which its poses are refused."""
    twist_rejection_threshold: Annotated[float, Positive] = 1e9
    """The same of its velocities."""
    linear_acceleration_rejection_threshold: Annotated[float, Positive] = 1e9
    """The same of its accelerations."""
    queue_size: Annotated[int, Interval(ge=1, le=10_000)] = 10
    """Messages that may wait until the filter looks at them."""
    remove_gravitational_acceleration: bool = True
    """Whether gravity is in its accelerations, and to be taken off."""
    estimate_bias: bool = True
    """Whether its bias is learnt while the wheels, the first `odomN`, stand (robot_localization does not)."""
    bias_stddev: Annotated[RadiansPerSecond, NotNegative] = 1e-3
    """Standard deviation of that bias before it was learnt; its datasheet tells."""

    def __post_init__(self) -> None:
        if not self.topic or len(self.config) != SIZE:
            raise ValueError(f"ekf_filter_node: a source needs a topic and a config of {SIZE} truth values")


def _which(*chosen: int) -> tuple[bool, ...]:
    return tuple(state in chosen for state in range(SIZE))


_WHEELS_AND_IMU = {
    "odom0": EkfSource(topic="odom", config=_which(states.VX, states.VY, states.VYAW)),
    "imu0": EkfSource(topic="imu", config=_which(states.VYAW)),
}


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

    ekf: Annotated[EkfConfig, Flat] = _ON_A_FLOOR
    """Of the filter itself."""
    period_ns: Annotated[PeriodNs, Positive, Le(1000.0)] = 20_000_000
    """How often it publishes; in scenarios once per period of the drive's controller."""
    publish_tf: bool = True
    """Whether it publishes odom → base; if not, the drive's controller does."""
    transform_time_offset_ns: Annotated[DurationNs, Interval(ge=-60.0, le=60.0)] = 0
    """That transform is stamped this far ahead."""
    smooth_lagged_data: bool = False
    """Whether what comes late counts at its time, and what was measured since once more."""
    history_length_ns: Annotated[DurationNs, Interval(ge=0.0, le=60.0)] = 0
    """How late that may be."""
    map_frame: Annotated[str, Derived] = "map"
    """Fixed in the world; of the filter it publishes nothing in it."""
    odom_frame: Annotated[str, Derived] = "odom"
    """In which it estimates."""
    base_link_frame: Annotated[str, Derived] = "base_footprint"
    """Of the robot."""
    world_frame: Annotated[str, Derived] = "odom"
    """Parent of the transform that is published."""
    sources: Annotated[Mapping[str, EkfSource], Flat, Underscored] = field(
        default_factory=lambda: _WHEELS_AND_IMU
    )
    """By robot_localization's names: `odomN`, `poseN`, `twistN`, `imuN`."""

    def __post_init__(self) -> None:
        for name in self.sources:
            if not re.fullmatch(SOURCE, name):
                raise ValueError(
                    f"ekf_filter_node: no source is called '{name}'; valid are odom0, pose0, twist0, imu0..."
                )


def for_robot(
    odom_frame: str, base_frame: str, period_ns: int, imu: str, bias_stddev: float
) -> EkfNodeConfig:
    """Return the defaults for a robot's frames, its control period [ns], and its IMU.

    Args:
        odom_frame: Name.
        base_frame: Name.
        period_ns: [ns]
        imu: Topic.
        bias_stddev: Of its gyroscope [rad/s].
    """
    return EkfNodeConfig(
        odom_frame=odom_frame,
        world_frame=odom_frame,
        base_link_frame=base_frame,
        period_ns=period_ns,
        sources={
            **_WHEELS_AND_IMU,
            "imu0": replace(_WHEELS_AND_IMU["imu0"], topic=imu, bias_stddev=bias_stddev),
        },
    )
