"""A robot as its file describes it: kinematics, dynamics, and as a model for other libraries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from twin.errors import ModelError, Problem
from twin.geometry import Array, Pose2, Pose3
from twin.models.description import Joint, Link, RobotDescription
from twin.models.dynamics import degrees_of_freedom, mass_matrix_and_gravity
from twin.models.kinematics import Positions, link_poses
from twin.models.loader import load
from twin.models.options import ReadOptions
from twin.models.sensors import SENSORS

if TYPE_CHECKING:
    import mujoco
    import yourdfpy

Base = Literal["free", "fixed", "kinematic"]


@dataclass(frozen=True)
class Robot:
    """A robot; `load_robot` reads one.

    Positions of joints are given by name, a number each [rad or m]; left out ones are at zero, joints that
    mimic others follow. Columns and rows of Jacobian and mass matrix are in the order of `velocities`, joints
    that mimic others taken as joints of their own; the base stands still.
    """

    description: RobotDescription
    """All that its file says, as data."""
    options: ReadOptions
    """How the file was read."""

    @property
    def name(self) -> str:
        """As in its file."""
        return self.description.name

    @property
    def links(self) -> Mapping[str, Link]:
        """By name, in the order of the file."""
        return self.description.links

    @property
    def joints(self) -> Mapping[str, Joint]:
        """By name, in the order of the file, fixed ones included."""
        return self.description.joints

    @property
    def root(self) -> str:
        """The link without a parent."""
        return self.description.root

    @property
    def mass(self) -> float:
        """Of all links [kg]."""
        return self.description.mass

    @property
    def velocities(self) -> tuple[str, ...]:
        """Names of the degrees of freedom: joints as in the file, planar and floating ones have several."""
        return degrees_of_freedom(self.description)

    def pose(self, link: str, positions: Positions | None = None, *, reference: str | None = None) -> Pose3:
        """Return the pose of a link, `T_reference_link`.

        Args:
            link: Its name.
            positions: Of joints.
            reference: A link; the root by default.

        Raises:
            ModelError: No such link or joint.
        """
        return self.description.pose(link, positions, reference=reference)

    def poses(self, positions: Positions | None = None) -> dict[str, Pose3]:
        """Return forward kinematics: `T_root_link` of every link, the root first.

        Raises:
            ModelError: No such joint.
        """
        self.pose(self.root, positions)  # refuses names of joints that it does not have
        return link_poses(self.description, positions)

    def jacobian(self, link: str, positions: Positions | None = None) -> Array:
        """Return how joint speeds move the origin of a link.

        Args:
            link: Its name.
            positions: Of joints.

        Returns:
            Shape (6, n), n = len(velocities): velocity [m/s], then angular velocity [rad/s], in the axes of
            the root, per speed of a joint.

        Raises:
            ModelError: No such link or joint.
        """
        return self.description.jacobian(link, positions)

    def mass_matrix(self, positions: Positions | None = None) -> Array:
        """Return the mass matrix, shape (n, n), n = len(velocities) [kg, kg m, kg m²].

        Raises:
            ModelError: No such joint.
        """
        self.pose(self.root, positions)
        return mass_matrix_and_gravity(self.description, positions or {})[0]

    def gravity_forces(self, positions: Positions | None = None) -> Array:
        """Return the forces that hold the joints against gravity along -z, shape (n,) [N or Nm].

        Raises:
            ModelError: No such joint.
        """
        self.pose(self.root, positions)
        return mass_matrix_and_gravity(self.description, positions or {})[1]

    def spec(self, base: Base = "free") -> mujoco.MjSpec:
        """Return the robot as a MuJoCo model: a body for each link, a joint of its name for each that moves.

        It is the caller's own, to be changed or attached to another one; `.compile()` makes an `MjModel`.

        Args:
            base: `free` gives the root link a free joint, `fixed` welds it to the world, `kinematic` makes it
                a mocap body.

        Raises:
            ConversionError: The robot has no faithful MuJoCo model.
        """
        from twin.convert import convert

        return convert(self.description, base=base).spec

    def urdf(self) -> yourdfpy.URDF:
        """Return the robot as a `yourdfpy.URDF`, meshes loaded, for whatever works with yourdfpy and trimesh.

        Raises:
            ModelError: yourdfpy is not installed.
        """
        try:
            import yourdfpy
        except ImportError as fault:
            raise ModelError(
                Problem("urdf() needs the package yourdfpy, which is not installed: pip install yourdfpy")
            ) from fault
        from twin.models.urdf.packages import PackagePath, Packages, locate

        source = self.description.source
        packages = Packages(PackagePath.of(source, self.options))
        return yourdfpy.URDF.load(
            BytesIO(self.description.urdf.encode()),
            filename_handler=lambda name: str(locate(name, source, packages).path or name),
        )

    def at(
        self, pose: Pose2 | Pose3 | Sequence[float], *, base: Base = "free", command_latency: float = 0.0
    ) -> Placed:
        """Return the robot at a place, for a `World`.

        Args:
            pose: x, y [m], yaw [rad] stand it on the floor; a `Pose3` is its root link's in the world.
            base: As for `spec`.
            command_latency: Between a command to its actuators and their start [s].
        """
        place = pose if isinstance(pose, Pose3) else Pose2(*pose)
        return Placed(robot=self, pose=place, base=base, command_latency=command_latency)


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A robot and where it starts in a world; see `Robot.at`."""

    robot: Robot
    pose: Pose2 | Pose3
    base: Base = "free"
    command_latency: float = 0.0


def load_robot(
    name_or_path: str | Path,
    args: Mapping[str, Any] | None = None,
    *,
    packages: Mapping[str, str | Path] | None = None,
    sensors: Sequence[str] = (),
    repair: bool = False,
) -> Robot:
    """Read a robot.

    Args:
        name_or_path: Of a robot that comes with twin, or a URDF or xacro file.
        args: Values of `<xacro:arg>`.
        packages: Folders of ROS packages that the file names, if they are not near it.
        sensors: Types of sensors of your own, `FILE.py:Class` or `module:Class`; they are executed.
        repair: Take the nearest physical inertia for a moving part whose own is impossible.

    Raises:
        ModelError: With every fault of the file, each with its line.
        PluginError: A sensor of your own is not there, or wrong.
    """
    options = ReadOptions(
        args={name: _text(value) for name, value in (args or {}).items()},
        packages={name: Path(folder) for name, folder in (packages or {}).items()},
        sensors=tuple(map(SENSORS.find, sensors)),
        execute=True,
        repair=repair,
    )
    return Robot(load(name_or_path, options), options)


def _text(value: Any) -> str:
    """Return a value as on a ROS command line."""
    return str(value).lower() if isinstance(value, bool) else str(value)
