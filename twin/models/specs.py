"""What a robot file says of drive, commands and sensors, as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from twin.geometry import Pose3
from twin.models.lens import Lens
from twin.models.wide_lens import WideLens
from twin.periods import Period, period_of
from twin.plugins import Plugin

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
class BatterySpec:
    """A battery, from the LinearBatteryPlugin in `<gazebo>`; what None is, the file does not say."""

    battery_name: str
    voltage: float
    """[V]"""
    capacity: float
    """[C]; the file has Ah"""
    initial_charge: float | None = None
    """[C]; the file has Ah"""
    open_circuit_voltage_constant_coef: float | None = None
    """[V]"""
    open_circuit_voltage_linear_coef: float | None = None
    """[V]"""
    resistance: float | None = None
    """[Ω]"""
    smooth_current_tau: float | None = None
    """[s]"""
    power_load: float | None = None
    """[W]"""
    enable_recharge: bool = False
    charging_time: float | None = None
    """[s]; the file has hours"""
    start_draining: bool | None = None
    line: int = 0


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

    kind: ClassVar[str] = ""
    """The name in `twin.models.sensors.SENSORS` of what it is read by; a user's has a `plugin`."""
    name: str
    link: str
    """The frame in which it measures and that stamps its messages."""
    topic: str
    """Relative ROS name, such as `scan`."""
    rate_hz: float
    T_link_sensor: Pose3 = field(default_factory=Pose3.from_xyz_rpy)
    """From the sensor's `<pose>`; `twin.sim` samples at the link's origin."""
    line: int = 0
    plugin: Plugin[Any] | None = field(default=None, repr=False, compare=False)
    """What reads, simulates and converts it, if it is a user's."""

    @property
    def period(self) -> Period:
        """Time between two samples [ns]."""
        return period_of(self.rate_hz)


@dataclass(frozen=True, kw_only=True)
class CameraTopics:
    """Relative ROS names of what a camera publishes."""

    image: str
    """Colours; JPEG pictures are below it, on `compressed`."""
    info: str
    depth: str
    depth_info: str
    points: str
    labels_map: str
    """What each pixel shows, of cameras that see the truth; so are those that follow."""
    colored_map: str
    label_info: str
    boxes: str

    @classmethod
    def below(cls, base: str) -> CameraTopics:
        """Return the names that drivers of RGB-D cameras use below `base`."""
        return cls(
            image=f"{base}/image_raw",
            info=f"{base}/camera_info",
            depth=f"{base}/depth/image_raw",
            depth_info=f"{base}/depth/camera_info",
            points=f"{base}/depth/points",
            **cls.of_truth(f"{base}/ground_truth"),
        )

    @staticmethod
    def of_truth(base: str) -> dict[str, str]:
        """Return the names that Gazebo uses below the topic of a camera of labels, by field."""
        names = ("labels_map", "colored_map", "label_info")
        return {**{name: f"{base}/{name}" for name in names}, "boxes": f"{base}/boxes"}


@dataclass(frozen=True, kw_only=True)
class DepthNoise:
    """How wrong a depth camera is; both models grow with the square of the distance."""

    model: Literal["realsense", "kinect"]
    baseline: float = 0.05
    """Between the two imagers of `realsense` [m]."""
    subpixel: float = 0.08
    """RMS error of its disparity [pixels]."""


@dataclass(frozen=True, kw_only=True)
class Exposure:
    """How brightly a camera takes its pictures."""

    gain: float = 1.0
    """By what a picture is brighter than it is drawn, if that is fixed."""
    target: float | None = None
    """Mean brightness that automatic exposure steers to, from 0 to 1; None: the gain is fixed."""
    lag: float = 0.3
    """Time constant with which its gain follows the light [s]."""
    min_gain: float = 0.125
    """Its least one."""
    max_gain: float = 8.0
    """Its largest one."""
    full_well: float = 10_000.0
    """Electrons in a pixel that is 255 with a gain of 1; their square root is its shot noise."""
    read_noise: float = 5.0
    """Standard deviation of what reading adds [electrons]."""


@dataclass(frozen=True, kw_only=True)
class CameraSpec(SensorSpec):
    """A camera that looks along +x of its link with +z up, as Gazebo's do."""

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
    depth_range: tuple[float, float] | None = None
    """Between which depths are told, if the file says so besides the clipping distances [m]."""
    noise_stddev: float = 0.0
    """Of a pixel's value, from 0 to 1."""
    noise_mean: float = 0.0
    """Likewise."""
    optical_frame: str | None = None
    """Frame that stamps its images: +z forward, +x right (REP-103)."""
    topics: CameraTopics = field(default_factory=lambda: CameraTopics.below("camera"))
    colour: bool = True
    """Whether it makes images of colours."""
    depth: bool = False
    """Whether it makes images of depth."""
    truth: Literal["semantic", "instance", "boxes"] | None = None
    """What it knows of things instead of seeing them: labels of kinds, or of each; or boxes around each."""
    encoding: Literal["rgb8", "bgr8", "mono8"] = "rgb8"
    """Of the images of colours."""
    depth_encoding: Literal["32FC1", "16UC1"] = "32FC1"
    """Metres, or millimetres (REP-118)."""
    depth_noise: DepthNoise | None = None
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Of `Lens`."""
    intrinsics: tuple[float, float, float, float] | None = None
    """Likewise."""
    baseline: float = 0.0
    """How far it is to the right of the left camera of a stereo pair, as CameraInfo's P tells it [m]."""
    exposure: Exposure | None = None
    """None: pictures are as bright as they are drawn."""
    wide: WideLens | None = None
    """The lens of a wide-angle camera."""

    @property
    def lens(self) -> Lens | WideLens:
        """How it projects."""
        return self.wide or Lens(
            width=self.width,
            height=self.height,
            horizontal_fov=self.horizontal_fov,
            distortion=self.distortion,
            intrinsics=self.intrinsics,
        )
