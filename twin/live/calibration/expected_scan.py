"""What the lidar of a scenario's robot sees, from anywhere in the scenario's world."""

from __future__ import annotations

import numpy as np

from twin.geometry import Pose2, Pose3
from twin.live.calibration.scan_pose import View
from twin.sensors.lidar import Lidar
from twin.sim.robot import RobotHandle
from twin.sim.world import World


class ExpectedScan:
    """Puts the robot somewhere and casts its lidar's rays, without noise; the world must not run then."""

    def __init__(self, world: World, robot: RobotHandle, lidar: Lidar) -> None:
        self._world, self._robot, self._lidar = world, robot, lidar
        link, base = f"{robot.name}/{lidar.spec.link}", world.pose(robot.base)
        self._height = float(base.xyz[2])
        T_base_lidar = base.inverse() @ world.pose(link)
        self.mount = T_base_lidar.to_pose2()
        """Of the lidar in the frame of the robot's root."""

    def __call__(self, lidar: Pose2) -> View:
        """Return what it sees from a pose of the lidar in the world."""
        base = lidar @ self.mount.inverse()
        self._robot.carry(Pose3.from_pose2(base, self._height))
        self._world.refresh_poses()
        ranges, directions, normals = self._lidar.look()
        toward = np.einsum("ij,ij->i", directions, normals)
        c, s = np.cos(lidar.yaw), np.sin(lidar.yaw)
        ahead, left = np.array([c, s, 0.0]), np.array([-s, c, 0.0])
        sideways = np.column_stack([-directions[:, 1], directions[:, 0], directions[:, 2]])
        far = np.where(np.isfinite(ranges), ranges, 0.0)
        turned = far * np.einsum("ij,ij->i", sideways, normals)
        with np.errstate(divide="ignore", invalid="ignore"):
            gradient = -np.column_stack([normals @ ahead, normals @ left, turned]) / toward[:, None]
        return View(ranges, toward, gradient)
