"""A scene with one driven robot as a MuJoCo model, and where its parts are in MuJoCo's arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.controllers.diff_drive import DiffDriveConfig
from twin.controllers.drive_config import drive_config
from twin.convert import convert
from twin.errors import GymError
from twin.geometry import Array, Pose2, Pose3
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses
from twin.runtime.defaults.from_description import footprint, scan_lidar
from twin.sensors.lidar import LidarSpec
from twin.sim.compose import FLOOR, GROUP_COLLISION, GROUP_SOLID, build_spec
from twin.sim.drive_check import calibrated_track_ratio
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene
from twin.sim.shapes import BodyShape, shapes

ROBOT = "robot"
"""Name of the robot in the model: its links are bodies `robot/<link>`."""
_TOUCHES = ("touches_all", "touches_floor", "touches_itself")
"""Contact sensors: how many contacts the robot has, and how many of them are no collision."""


@dataclass(frozen=True, kw_only=True)
class Wheels:
    """The driven wheels, those of the left side first; each array has shape (w,)."""

    qpos: NDArray[np.intp]
    dof: NDArray[np.intp]
    actuator: NDArray[np.intp]
    body: NDArray[np.intp]
    is_left: NDArray[np.bool_]


class DrivenRobot:
    """What an environment needs to know of its robot."""

    def __init__(self, name: str, *, timestep: float) -> None:
        """Read a robot by its name in the catalogue, or its file; `timestep` of the physics [s].

        Raises:
            ModelError: It cannot be read.
            GymError: It has no drive, or no lidar.
        """
        self.description: RobotDescription = load(name)
        self._timestep = timestep
        drive, lidar = self.description.drive, scan_lidar(self.description)
        if drive is None or lidar is None:
            lacks = "drive plugin" if drive is None else "lidar on topic scan"
            raise GymError(f"{self.description.source}: robot '{name}' has no {lacks}, which it needs here")
        self.spec = drive
        self.lidar: LidarSpec = lidar
        self._conversion = convert(self.description, timestep=timestep, visuals=False)
        ratio = calibrated_track_ratio(self._conversion, timestep=timestep)
        self.drive: DiffDriveConfig = drive_config(drive, self.description, calibrated_ratio=ratio)
        self.footprint: Array = footprint(self.description, padding=0.0)
        """Corners in the root frame, shape (4, 2) [m]."""
        self.T_root_lidar: Pose3 = link_poses(self.description)[lidar.link]
        self.spawn_height = self._conversion.spawn_height

    def compile(self, scene: Scene, *, visuals: bool = False) -> mujoco.MjModel:
        """Return the model of the robot in a scene; `visuals` are for rendering, and change no physics."""
        conversion = self._conversion
        if visuals:
            conversion = convert(self.description, timestep=self._timestep)
        placement = RobotPlacement(name=ROBOT, conversion=conversion, pose=Pose2(0.0, 0.0, 0.0))
        # Nothing sleeps here, and a batch would have to keep the whole data of each simulation for it.
        spec = build_spec(scene, [placement], Physics(timestep=self._timestep, sleep=False))
        root = f"{ROBOT}/{self.description.root}"
        body, geom, none = mujoco.mjtObj.mjOBJ_XBODY, mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtObj.mjOBJ_UNKNOWN
        others = ((none, ""), (geom, FLOOR), (body, root))
        for sensor, (kind, other) in zip(_TOUCHES, others, strict=True):
            spec.add_sensor(
                name=sensor,
                type=mujoco.mjtSensor.mjSENS_CONTACT,
                objtype=body,
                objname=root,
                reftype=kind,
                refname=other,
                intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 0, 1],
            )
        return spec.compile()

    def shapes(self, scene: Scene) -> list[BodyShape]:
        """Return everything there is to draw in a scene except for the floor."""
        placement = RobotPlacement(name=ROBOT, conversion=self._conversion, pose=Pose2(0.0, 0.0, 0.0))
        return list(shapes(scene, [placement]))

    def wheels(self, model: mujoco.MjModel) -> Wheels:
        """Return where the driven wheels are in the arrays of a model."""
        joints = [
            model.joint(f"{ROBOT}/{name}") for name in (*self.spec.left_joints, *self.spec.right_joints)
        ]
        names = [joint.name for joint in joints]
        left = len(self.spec.left_joints)
        return Wheels(
            qpos=np.array([joint.qposadr[0] for joint in joints], np.intp),
            dof=np.array([joint.dofadr[0] for joint in joints], np.intp),
            actuator=np.array([model.actuator(name).id for name in names], np.intp),
            body=np.array([model.jnt_bodyid[joint.id] for joint in joints], np.intp),
            is_left=np.arange(len(joints)) < left,
        )

    def beams(self, count: int) -> Array:
        """Return the directions of `count` of the lidar's rays in the root frame, shape (count, 3).

        Raises:
            GymError: Not every so-manieth ray of the lidar.
        """
        samples = self.lidar.samples
        if not 1 <= count <= samples or samples % count:
            raise GymError(f"beams is {count}; valid: a number that divides the lidar's {samples} rays")
        angles = np.linspace(self.lidar.angle_min, self.lidar.angle_max, samples)[:: samples // count]
        level = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(count)))
        turned = Pose3(np.zeros(3), self.T_root_lidar.quat_wxyz)
        return turned.apply(level)

    @cached_property
    def seen(self) -> NDArray[np.uint8]:
        """Groups of the geoms that the lidar sees, shape (mjNGROUP,)."""
        groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
        groups[[GROUP_SOLID, GROUP_COLLISION]] = 1
        return groups
