"""What a robot file says of drive, commands and sensors, as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from twin.geometry import Pose3
from twin.periods import Period, period_of

Interface = Literal["position", "velocity", "effort"]
"""Of ros2_control: [rad or m], [rad/s or m/s], [Nm or N]."""


@dataclass(frozen=True, kw_only=True)
class DriveSpec:
    """A wheeled drive, from the diff-drive or skid-steer plugin in `<gazebo>`."""

    kind: Literal["diff_drive", "skid_steer"]
    left_joints: tuple[str, ...]
    right_joints: tuple[str, ...]
    wheel_separation: float
    """Distance of the left and right wheels' contact points [m]."""
    wheel_radius: float
    """[m]"""
    max_wheel_torque: float | None = None
    """[Nm] per wheel"""
    max_linear_velocity: float | None = None
    """[m/s]"""
    max_linear_acceleration: float | None = None
    """[m/s²]"""
    max_angular_velocity: float | None = None
    """[rad/s]"""
    max_angular_acceleration: float | None = None
    """[rad/s²]"""
    odometry_frame: str = "odom"
    base_frame: str = "base_footprint"
    guessed: bool = False
    """The file has no drive plugin; its wheels suggest this drive."""
    line: int = 0

    @property
    def words(self) -> str:
        """What it is, for people."""
        joints = [", ".join(f"'{name}'" for name in side) for side in (self.left_joints, self.right_joints)]
        size = f"wheel_radius {self.wheel_radius:g} m, wheel_separation {self.wheel_separation:g} m"
        return f"{self.kind} with {joints[0]} left, {joints[1]} right, {size}"


@dataclass(frozen=True, kw_only=True)
class CommandSpec:
    """How a joint is commanded, from `<ros2_control>` or `<transmission>` (wheels of a drive need none)."""

    joint: str
    interface: Interface
    lower: float | None = None
    """Least command that `<param name='min'>` allows, in the interface's unit."""
    upper: float | None = None
    """Largest command."""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class SensorSpec:
    """Common part of all sensors, from `<gazebo reference="link"><sensor>`."""

    name: str
    link: str
    """The frame in which it measures and that stamps its messages."""
    topic: str
    """Relative ROS name, such as `scan`."""
    rate_hz: float
    T_link_sensor: Pose3 = field(default_factory=Pose3.from_xyz_rpy)
    """From the sensor's `<pose>`; `twin.sim` samples at the link's origin."""
    line: int = 0

    @property
    def period(self) -> Period:
        """Time between two samples [ns]."""
        return period_of(self.rate_hz)


@dataclass(frozen=True, kw_only=True)
class LidarSpec(SensorSpec):
    """A planar lidar: `samples` rays from angle_min to angle_max, both included."""

    angle_min: float
    """[rad]"""
    angle_max: float
    """[rad]"""
    samples: int
    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    noise_stddev: float = 0.0
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class RangeSpec(SensorSpec):
    """An ultrasonic ranger: the nearest echo in a cone about +x (REP-103)."""

    field_of_view: float
    """Full angle of the cone [rad]."""
    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    noise_stddev: float = 0.0
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class ImuSpec(SensorSpec):
    """Gyroscope and accelerometer."""

    gyro_noise_stddev: float = 0.0
    """[rad/s]"""
    gyro_bias_stddev: float = 0.0
    """Of the constant bias, drawn once a run [rad/s]."""
    accel_noise_stddev: float = 0.0
    """[m/s²]"""


@dataclass(frozen=True, kw_only=True)
class ContactSpec(SensorSpec):
    """A bumper: tells whether its link touches anything."""


@dataclass(frozen=True, kw_only=True)
class CameraSpec(SensorSpec):
    """A camera that looks along +x of its link with +z up, as Gazebo's do; `twin.sim` renders none."""

    horizontal_fov: float
    """Full angle [rad]."""
    width: int
    """[pixels]"""
    height: int
    """[pixels]"""
    near: float
    """Clipping distance [m]."""
    far: float
    """Clipping distance [m]."""
    noise_stddev: float = 0.0
    """Of a pixel's value, from 0 to 1."""
    optical_frame: str | None = None
    """Frame that stamps its images: +z forward, +x right (REP-103)."""
