"""Physics and sensors without any node."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from twin.api.robot import Placed, Robot
from twin.api.truth import Truth
from twin.controllers.diff_drive import DiffDriveController
from twin.controllers.drive_config import drive_config
from twin.convert import convert
from twin.convert.conversion import Conversion
from twin.errors import SimulationError, nearest
from twin.geometry import Pose2, Pose3
from twin.sim.drive_check import calibrated_track_ratio
from twin.sim.hardware import JointReading
from twin.sim.physics import Physics
from twin.sim.robot import RobotHandle, RobotPlacement
from twin.sim.scene import Scene
from twin.sim.world import World as SimWorld
from twin.warehouse import arena as arenas
from twin.warehouse.arena import Arena


class World(Truth):
    """Robots in an arena, stepped by hand: commands to actuators in, readings of sensors and the truth out.

    The same seed and the same commands give the same numbers, to the last bit.
    """

    def __init__(
        self,
        robots: Robot | Placed | Mapping[str, Robot | Placed],
        *,
        arena: Arena | str | Path | None = None,
        goods: Collection[str] = (),
        timestep: float = 0.002,
        control_period: float = 0.02,
        seed: int = 0,
        visuals: bool = False,
    ) -> None:
        """Build and compile.

        Args:
            robots: By name; one alone has its own name. Where `Robot.at` says, else at the origin.
            arena: Name, file, or what `load_arena` returned; None: an empty floor.
            goods: Totes of the arena that can be moved; all others are scenery.
            timestep: Of the physics [s].
            control_period: Between two commands, a whole number of physics steps [s].
            seed: Of all noise.
            visuals: Compile what is seen only, too, for rendering.

        Raises:
            TwinError: Something has no model, or a name that is taken or not known.
        """
        if isinstance(robots, Robot | Placed):
            robots = {(robots.robot if isinstance(robots, Placed) else robots).name: robots}
        physics = Physics(timestep=timestep)
        self._substeps = round(control_period * 1e9) // physics.timestep_ns
        if not self._substeps or self._substeps * physics.timestep_ns != round(control_period * 1e9):
            raise SimulationError(
                f"a control_period of {control_period:g} s is no whole number of steps of {timestep:g} s"
            )
        placements = [_placement(name, robot, timestep) for name, robot in robots.items()]
        scene = Scene(name="world")
        if arena is not None:
            hall = arena if isinstance(arena, Arena) else arenas.load(arena)
            scene = hall.scene([hall.tote(name).name for name in goods], seed=seed)
        super().__init__(SimWorld.compose(scene, placements, physics, seed=seed, visuals=visuals))
        period = control_period
        self.robots: Mapping[str, PlacedRobot] = MappingProxyType(
            {
                placement.name: PlacedRobot(self._world, placement.conversion, placement.name, period)
                for placement in placements
            }
        )
        """By name."""

    def step(self, n: int = 1) -> None:
        """Advance by `n` control periods.

        Raises:
            SimulationError: The physics diverged.
        """
        for _ in range(n):
            for robot in self.robots.values():
                robot.apply()
            self._world.step(self._substeps)

    def advance(self, seconds: float) -> None:
        """Advance by simulated time [s], rounded to control periods.

        Raises:
            SimulationError: The physics diverged.
        """
        self.step(round(seconds * 1e9 / (self._substeps * self._world.timestep_ns)))

    def save_model(self, folder: str | Path) -> Path:
        """Write the world as `world.xml` with its meshes, for any MuJoCo tool, and return that file."""
        return self._world.save_model(Path(folder))


class PlacedRobot:
    """A robot of a world: its actuators and sensors."""

    def __init__(self, world: SimWorld, conversion: Conversion, name: str, control_period: float) -> None:
        self._world = world
        self._conversion = conversion
        self._handle: RobotHandle = world.robots[name]
        self._period = control_period
        self._sensors = {sensor.spec.name: sensor for sensor in self._handle.sensors}
        self._is_driven = False
        self.name = name

    @property
    def commanded_joints(self) -> tuple[str, ...]:
        """Joints that `command` takes."""
        return self._handle.hardware.commanded_joints

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The order of `joints`."""
        return self._handle.hardware.joint_names

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names that `read` takes."""
        return tuple(self._sensors)

    def command(self, values: Mapping[str, float]) -> None:
        """Set what actuators are to do from the next step on, until they are told otherwise.

        Args:
            values: By joint: a velocity of wheels [rad/s], else what the file's command interface says:
                position [rad or m], velocity, or effort [N or Nm].

        Raises:
            SimulationError: No actuator moves a joint, or a value is not finite.
        """
        for joint, value in values.items():
            if not math.isfinite(value):
                raise SimulationError(f"the command {value} for joint '{joint}' is not finite")
            self._handle.hardware.command(joint, value)

    def drive(self, linear: float, angular: float) -> None:
        """Drive by the wheels from the next step on, within the limits of the drive, until told otherwise.

        Args:
            linear: Forward [m/s].
            angular: To the left [rad/s].

        Raises:
            SimulationError: The robot has no wheels to drive by, or a value is not finite.
        """
        if not self._controller.set_command(linear, angular):
            raise SimulationError(f"the velocity {linear}, {angular} is not finite")
        self._is_driven = True

    def joints(self) -> JointReading:
        """Measure all joints: position [rad or m], velocity, effort, each of shape (len(joint_names),)."""
        return self._handle.hardware.read()

    def read(self, sensor: str) -> Any:
        """Return what a sensor measures now, noise included: a reading with numpy arrays and `time_ns`.

        Raises:
            SimulationError: The robot has no such sensor.
        """
        if sensor not in self._sensors:
            raise SimulationError(
                f"robot '{self.name}' has no sensor '{sensor}'; {nearest(sensor, self._sensors)}"
            )
        return self._sensors[sensor].sample(self._world.time_ns)

    def pose(self, link: str | None = None) -> Pose3:
        """Return the true pose of a link in the world, of the root by default.

        Raises:
            ScenarioError: The robot has no such link.
        """
        return self._world.pose(self._handle.base if link is None else self._handle.body(link))

    def apply(self) -> None:
        """Hand the commands to the physics; `World.step` does it."""
        if self._is_driven:
            drive = self._handle.description.drive
            assert drive is not None
            wheels = self._controller.update(self._period)
            self.command(dict.fromkeys(drive.left_joints, wheels.left))
            self.command(dict.fromkeys(drive.right_joints, wheels.right))
        self._handle.hardware.apply()

    @cached_property
    def _controller(self) -> DiffDriveController:
        description = self._handle.description
        if description.drive is None:
            raise SimulationError(f"robot '{self.name}' has no drive plugin; command its joints instead")
        ratio = calibrated_track_ratio(self._conversion, timestep=self._world.physics.timestep)
        config = drive_config(description.drive, description, calibrated_ratio=ratio)
        return DiffDriveController(replace(config, cmd_vel_timeout=math.inf))


def _placement(name: str, robot: Robot | Placed, timestep: float) -> RobotPlacement:
    placed = robot if isinstance(robot, Placed) else robot.at(Pose2(0.0, 0.0, 0.0))
    return RobotPlacement(
        name=name,
        conversion=convert(placed.robot.description, base=placed.base, timestep=timestep),
        pose=placed.pose,
        command_latency=placed.command_latency,
    )
