"""Closed-form kinematics of a lift with a telescopic arm and a wrist that turns about the vertical."""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.manipulation.trajectory import JointLimits


@dataclass(frozen=True, kw_only=True)
class TelescopicArmConfig:
    """Geometry in the robot's base frame: x forward, z up."""

    lift_joint: str
    extension_joint: str
    """The commanded stage; the others mimic it."""
    wrist_joint: str
    extension_ratio: float
    """Travel of the wrist per travel of the commanded joint."""
    wrist_x: float
    """x of the wrist's axis with all joints at zero [m]."""
    grasp_z: float
    """z of the grasp frame with all joints at zero [m]."""
    grasp_length: float
    """Distance of the grasp frame from the wrist's axis [m]."""


@dataclass(frozen=True, kw_only=True)
class GraspPose:
    """Where the grasp frame is to be, in the base frame."""

    x: float
    """[m]"""
    z: float
    """[m]"""
    yaw: float = 0.0
    """[rad]; the lateral position follows from it, as the arm has no joint for that."""


class TelescopicArm:
    """Maps grasp poses to joint positions and back."""

    def __init__(self, config: TelescopicArmConfig, limits: dict[str, JointLimits]) -> None:
        self.config = config
        self.limits = limits

    def inverse(self, pose: GraspPose) -> dict[str, float]:
        """Return the joint positions for a grasp pose.

        Raises:
            ValueError: A joint would leave its range; the text names joint, value and range.
        """
        config = self.config
        reach = pose.x - config.wrist_x - config.grasp_length * math.cos(pose.yaw)
        joints = {
            config.lift_joint: pose.z - config.grasp_z,
            config.extension_joint: reach / config.extension_ratio,
            config.wrist_joint: pose.yaw,
        }
        for name, value in joints.items():
            limit = self.limits[name]
            if not limit.lower - 1e-6 <= value <= limit.upper + 1e-6:
                raise ValueError(
                    f"grasp at x {pose.x:.3f} m, z {pose.z:.3f} m, yaw {pose.yaw:.3f} rad is out of reach: "
                    f"'{name}' would be at {value:.3f}, its range is {limit.lower:.3f} … {limit.upper:.3f}"
                )
        return joints

    def forward(self, joints: dict[str, float]) -> tuple[GraspPose, float]:
        """Return the grasp pose for joint positions, and its lateral position y [m]."""
        config = self.config
        yaw = joints[config.wrist_joint]
        wrist_x = config.wrist_x + config.extension_ratio * joints[config.extension_joint]
        pose = GraspPose(
            x=wrist_x + config.grasp_length * math.cos(yaw),
            z=config.grasp_z + joints[config.lift_joint],
            yaw=yaw,
        )
        return pose, config.grasp_length * math.sin(yaw)
