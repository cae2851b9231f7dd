"""What a robot file says, as data: links, joints, drive and sensors, each with the line it came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from twin.errors import ModelError, Problem, nearest
from twin.geometry import Array, Pose3
from twin.models.line_table import LineTable

if TYPE_CHECKING:
    from twin.models.kinematics import Positions
    from twin.models.mass_properties import Settlement


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box."""

    size: tuple[float, float, float]
    """Full edge lengths along x, y, z [m]."""


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder along its z axis."""

    radius: float
    """[m]"""
    length: float
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """A sphere."""

    radius: float
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """A capsule along its z axis (an extension of URDF that Gazebo and Drake read too)."""

    radius: float
    """[m]"""
    length: float
    """Of the cylindrical part [m]."""


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A mesh file."""

    path: Path
    """Resolved, existing file."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    apply_up_axis: bool = True
    """Turn a COLLADA file as its `<up_axis>` says."""


Geometry = Box | Cylinder | Sphere | Capsule | Mesh


@dataclass(frozen=True, kw_only=True)
class Inertial:
    """Mass properties of a link."""

    T_link_com: Pose3
    """Pose of the inertial frame in the link frame."""
    mass: float
    """[kg]"""
    inertia: Array
    """About the centre of mass, in the inertial frame [kg m²], shape (3, 3)."""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class Visual:
    """A shape to look at."""

    T_link_geometry: Pose3
    geometry: Geometry
    rgba: tuple[float, float, float, float] = (0.7, 0.7, 0.7, 1.0)
    """Resolved from the file's materials."""
    has_material: bool = True
    """Without one, a mesh may have a colour of its own."""
    name: str = ""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class Collision:
    """A shape to touch."""

    T_link_geometry: Pose3
    geometry: Geometry
    name: str = ""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class SkippedMesh:
    """A shape that was left out, as its mesh is missing or unreadable and the options allow that."""

    link: str
    role: Literal["visual", "collision"]
    reference: str
    """The mesh as the file names it."""
    reason: str
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Contact parameters of a link, from `<gazebo reference="link">`."""

    friction: float | None = None
    """Coulomb coefficient, from mu1."""
    friction2: float | None = None
    """In the second direction, from mu2; no effect, as MuJoCo's friction is the same in every direction."""
    gravity: bool = True
    """False for a link that gravity does not pull, from turnGravityOff or gravity."""
    self_collide: bool | None = None
    """Whether it touches the robot's other links; None means that the file does not say."""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A spring in a joint, from `<gazebo reference="joint">`."""

    stiffness: float
    """[Nm/rad] or [N/m]"""
    reference: float = 0.0
    """Position without force [rad] or [m]."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A rigid body and the frame of the same name."""

    name: str
    inertial: Inertial | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Collision, ...] = ()
    surface: Surface = field(default_factory=Surface)
    line: int = 0


JointType = Literal["fixed", "continuous", "revolute", "prismatic", "floating", "planar"]


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Limits of a joint; None means that the file gives none."""

    lower: float | None = None
    """[rad] or [m]"""
    upper: float | None = None
    """[rad] or [m]"""
    effort: float | None = None
    """[Nm] or [N]"""
    velocity: float | None = None
    """[rad/s] or [m/s]"""


@dataclass(frozen=True, kw_only=True)
class Mimic:
    """This joint's position is `multiplier` times the leader's plus `offset`."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A connection of two links."""

    name: str
    type: JointType
    parent: str
    child: str
    T_parent_joint: Pose3
    """Pose of the joint (and child link) frame in the parent link frame at position zero."""
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    """Unit vector in the joint frame."""
    limit: Limit = field(default_factory=Limit)
    damping: float = 0.0
    """[Nm s/rad] or [N s/m]"""
    friction: float = 0.0
    """[Nm] or [N]"""
    mimic: Mimic | None = None
    line: int = 0


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

    name: str
    link: str
    """The frame in which it measures and that stamps its messages."""
    topic: str
    """Relative ROS name, such as `scan`."""
    rate_hz: float
    T_link_sensor: Pose3 = field(default_factory=Pose3.from_xyz_rpy)
    """From the sensor's `<pose>`; `twin.sim` samples at the link's origin."""
    line: int = 0


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


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """A robot: a tree of links that are connected by joints, its drive and its sensors."""

    name: str
    source: Path
    """The file as given by the user."""
    urdf: str
    """The URDF text after xacro; what `/robot_description` publishes."""
    links: Mapping[str, Link]
    """By name, in file order."""
    joints: Mapping[str, Joint]
    """By name, in file order."""
    root: str
    """The link without a parent."""
    drive: DriveSpec | None = None
    commands: Mapping[str, CommandSpec] = field(default_factory=dict)
    """By joint."""
    states: Mapping[str, tuple[Interface, ...]] = field(default_factory=dict)
    """What `<ros2_control>` reads of joints, by joint."""
    sensors: tuple[SensorSpec, ...] = ()
    warnings: tuple[Problem, ...] = ()
    """What was left out when the file was read."""
    lines: LineTable | None = field(default=None, repr=False)
    """Where the elements of `urdf` come from, if it is not the text of `source`."""
    skipped_meshes: tuple[SkippedMesh, ...] = ()
    """In file order."""
    """Those that `twin.sim` samples."""
    cameras: tuple[CameraSpec, ...] = ()
    springs: Mapping[str, Spring] = field(default_factory=dict)
    """By joint."""
    static: bool = False
    """Bolted down, from `<gazebo><static>`."""
    self_collide: bool | None = None
    """Whether links that do not say touch each other, from `<gazebo><self_collide>`; None: not said."""

    def children(self, link: str) -> tuple[Joint, ...]:
        """Return the joints below `link`, in file order."""
        return self._children.get(link, ())

    @cached_property
    def _children(self) -> Mapping[str, tuple[Joint, ...]]:
        below: dict[str, list[Joint]] = {}
        for joint in self.joints.values():
            below.setdefault(joint.parent, []).append(joint)
        return {link: tuple(joints) for link, joints in below.items()}

    @cached_property
    def settlement(self) -> Settlement:
        """Mass properties that a physics engine can take, by `twin.models.mass_properties.settle`."""
        from twin.models.mass_properties import settle

        return settle(self)

    def pose(self, frame: str, positions: Positions | None = None, *, reference: str | None = None) -> Pose3:
        """Return the pose of a link's frame in that of another, `T_reference_frame`.

        Args:
            frame: A link.
            positions: Of joints by name, as for `twin.models.link_poses`; left out ones are at zero.
            reference: A link; the root by default.

        Raises:
            ModelError: No such link or joint.
        """
        from twin.models.kinematics import link_poses

        self._check(positions, frame, reference)
        poses = link_poses(self, positions)
        return poses[reference or self.root].inverse() @ poses[frame]

    def jacobian(self, frame: str, positions: Positions | None = None) -> Array:
        """Return how joint speeds move a link's frame, base still.

        Args:
            frame: A link.
            positions: Of joints by name, as for `twin.models.link_poses`; left out ones are at zero.

        Returns:
            Shape (6, n), a column for each of `twin.models.dynamics.degrees_of_freedom`: velocity [m/s] and
            angular velocity [rad/s] of the frame, in root axes, per joint speed.

        Raises:
            ModelError: No such link or joint.
        """
        from twin.models.dynamics import jacobian
        from twin.models.kinematics import link_poses

        self._check(positions, frame)
        return jacobian(self, frame, link_poses(self, positions))

    def _check(self, positions: Positions | None, *frames: str | None) -> None:
        problems = [
            f"{self.source}: robot '{self.name}' has no {kind} '{name}'; {nearest(name, valid)}"
            for kind, names, valid in (("link", frames, self.links), ("joint", positions or (), self.joints))
            for name in names
            if name is not None and name not in valid
        ]
        if problems:
            raise ModelError(map(Problem, problems))
