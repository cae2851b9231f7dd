"""What the lidar of a scenario's robot sees, from anywhere in the scenario's world."""

from __future__ import annotations

import numpy as np

from twin.geometry import Pose2, Pose3
from twin.live.calibration.scan_pose import View
from twin.sensors.lidar import Lidar
from twin.sim.robot import RobotHandle
from twin.sim.world import World


class ExpectedScan:
    """Casts the rays of the robot's lidar as if it were somewhere else, without noise."""

    def __init__(self, world: World, robot: RobotHandle, lidar: Lidar) -> None:
        self._world, self._robot, self._lidar = world, robot, lidar
        T_base_lidar = world.pose(robot.base).inverse() @ world.pose(f"{robot.name}/{lidar.spec.link}")
        self.mount = T_base_lidar.to_pose2()
        """Of the lidar in the frame of the robot's root."""

    def __call__(self, lidar: Pose2) -> View:
        """Return what it sees from a pose of the lidar in the world."""
        height = float(self._world.pose(self._robot.base).xyz[2])
        with self._world.elsewhere(self._robot.base, Pose3.from_pose2(lidar @ self.mount.inverse(), height)):
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
