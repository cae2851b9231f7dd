"""A robot in a world: where it is put, and the handle by which the runtime drives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco

from twin.convert.conversion import Conversion
from twin.geometry import Pose2, Pose3
from twin.models.description import RobotDescription

if TYPE_CHECKING:
    from twin.sim.cameras.camera import Camera
    from twin.sim.hardware import Hardware
    from twin.sim.sensors import SampledSensor


@dataclass(frozen=True, kw_only=True)
class RobotPlacement:
    """A robot and where it starts; `convert(base=...)` chose whether its base is free, fixed or kinematic."""

    name: str
    """Prefix of its elements in the model: link `base_link` is the body `<name>/base_link`."""
    conversion: Conversion
    pose: Pose2 | Pose3
    """Of the root link in the world; a Pose2 stands the robot on the floor."""
    command_latency: float = 0.0
    """Between a command to its actuators and their start [s]."""

    @property
    def T_world_root(self) -> Pose3:
        """The root link's pose."""
        if isinstance(self.pose, Pose2):
            return Pose3.from_pose2(self.pose, self.conversion.spawn_height)
        return self.pose


@dataclass(kw_only=True, eq=False)
class RobotHandle:
    """One robot of a compiled world."""

    name: str
    description: RobotDescription
    hardware: Hardware
    sensors: tuple[SampledSensor, ...]
    cameras: tuple[Camera, ...]
    data: mujoco.MjData
    mocap_id: int
    """Of the root link in `data`; negative without a kinematic base."""
    free_joint: tuple[int, int] | None
    """Where that of the root link is in `qpos` and in `qvel`; None: it has none."""

    @property
    def base(self) -> str:
        """Name of the root link's body."""
        return self.body(self.description.root)

    def body(self, link: str) -> str:
        """Return the name of a link's body."""
        return f"{self.name}/{link}"

    @property
    def is_free(self) -> bool:
        """Whether the base moves as physics has it: neither fixed nor kinematic."""
        return self.free_joint is not None

    def carry(self, T_world_root: Pose3) -> None:
        """Lift the robot and put it down at rest elsewhere, its joints as they are, with the next step.

        Raises:
            ValueError: Its base is not free.
        """
        if self.free_joint is None:
            raise ValueError(f"robot '{self.name}' has no free base")
        qpos, dof = self.free_joint
        self.data.qpos[qpos : qpos + 7] = [*T_world_root.xyz, *T_world_root.quat_wxyz]
        self.data.qvel[dof : dof + 6] = 0.0
        self.hardware.reset()

    def set_kinematic_pose(self, T_world_root: Pose3) -> None:
        """Put a robot with a kinematic base somewhere; takes effect with the next step.

        Raises:
            ValueError: The robot was not converted with `base="kinematic"`.
        """
        if self.mocap_id < 0:
            raise ValueError(f"robot '{self.name}' has no kinematic base; convert it with base='kinematic'")
        self.data.mocap_pos[self.mocap_id] = T_world_root.xyz
        self.data.mocap_quat[self.mocap_id] = T_world_root.quat_wxyz
