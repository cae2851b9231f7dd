"""What a robot file says, as data: links, joints, drive and sensors, each with the line it came from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from twin.errors import ModelError, Problem, nearest
from twin.geometry import Array, Pose3
from twin.models.shapes import Collision, Shape, SkippedMesh, Visual
from twin.models.specs import BatterySpec, CameraSpec, CommandSpec, DriveSpec, Interface, SensorSpec
from twin.models.urdf.line_table import LineTable

if TYPE_CHECKING:
    from twin.models.kinematics import Positions
    from twin.models.mass_properties import Settlement

WORLD = "world"
"""A root link of this name means a robot that is bolted down."""


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
class Surface:
    """Contact parameters of a link, from `<gazebo reference="link">`."""

    friction: float | None = None
    """Coulomb coefficient, from mu1."""
    gravity: bool = True
    """False for a link that gravity does not pull, from turnGravityOff or gravity."""
    self_collide: bool | None = None
    """Whether it touches the robot's other links; None means that the file does not say."""


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

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """What can be seen, then what can be touched."""
        return (*self.visuals, *self.collisions)


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
    battery: BatterySpec | None = None
    commands: Mapping[str, CommandSpec] = field(default_factory=dict)
    """By joint."""
    states: Mapping[str, tuple[Interface, ...]] = field(default_factory=dict)
    """What `<ros2_control>` reads of joints, by joint."""
    sensors: tuple[SensorSpec, ...] = ()
    """Those that `twin.sim` samples."""
    warnings: tuple[Problem, ...] = ()
    """What was left out when the file was read."""
    lines: LineTable | None = field(default=None, repr=False)
    """Where the elements of `urdf` come from, if it is not the text of `source`."""
    skipped_meshes: tuple[SkippedMesh, ...] = ()
    """In file order."""
    cameras: tuple[CameraSpec, ...] = ()
    springs: Mapping[str, Spring] = field(default_factory=dict)
    """By joint."""
    static: bool = False
    """Bolted down, from `<gazebo><static>`."""
    self_collide: bool | None = None
    """Whether links that do not say touch each other, from `<gazebo><self_collide>`; None: not said."""

    @property
    def left_out(self) -> tuple[Problem, ...]:
        """Why sensors of the file are none."""
        return tuple(warning for warning in self.warnings if warning.code == "not-simulated")

    @cached_property
    def outwards(self) -> tuple[Joint, ...]:
        """The joints that can be reached from the root, each after the one above it, breadth first."""
        links, joints = [self.root], list[Joint]()
        for link in links:
            joints += self.children(link)
            links += [joint.child for joint in self.children(link)]
        return tuple(joints)

    def children(self, link: str) -> tuple[Joint, ...]:
        """Return the joints below `link`, in file order."""
        return self._children.get(link, ())

    @cached_property
    def _children(self) -> Mapping[str, tuple[Joint, ...]]:
        below: dict[str, list[Joint]] = {}
        for joint in self.joints.values():
            below.setdefault(joint.parent, []).append(joint)
        return {link: tuple(joints) for link, joints in below.items()}

    def above(self, link: str) -> Iterator[Joint]:
        """Yield the joints between `link` and the root, from the link on."""
        while link in self._parents:
            yield self._parents[link]
            link = self._parents[link].parent

    @cached_property
    def _parents(self) -> Mapping[str, Joint]:
        return {joint.child: joint for joint in self.joints.values()}

    @property
    def mass(self) -> float:
        """Of all links [kg]."""
        return sum(link.inertial.mass for link in self.links.values() if link.inertial is not None)

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
