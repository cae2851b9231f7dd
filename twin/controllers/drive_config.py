"""The drive controller's numbers, read off a robot's description."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from twin.controllers.diff_drive import DiffDriveConfig
from twin.controllers.limiter import AxisLimits
from twin.controllers.odometry import DIFF_DRIVE, SKID_STEER, OdometryNoise
from twin.controllers.skid_steer import cornering_slip, track_ratio, weight_shares
from twin.geometry import Array
from twin.models.description import RobotDescription
from twin.models.dynamics import STANDARD_GRAVITY
from twin.models.kinematics import link_poses
from twin.models.specs import DriveSpec

_LEAST_FRICTION = 0.1
"""Wheels on less than that are on ice."""


def drive_config(
    drive: DriveSpec, description: RobotDescription, *, calibrated_ratio: float | None = None
) -> DiffDriveConfig:
    """Return the kinematics and limits of a robot's drive.

    Args:
        drive: The drive of `description`.
        description: The robot.
        calibrated_ratio: Effective over geometric track, where it was measured; else the analytic one.
    """
    linear, angular = drive.max_linear_velocity or 1.0, drive.max_angular_velocity or 2.0
    wheels = (*drive.left_joints, *drive.right_joints)
    return DiffDriveConfig(
        wheel_separation=drive.wheel_separation,
        wheel_radius=drive.wheel_radius,
        wheel_separation_multiplier=calibrated_ratio or analytic_track_ratio(drive, description),
        linear=AxisLimits(
            max_velocity=linear, max_acceleration=drive.max_linear_acceleration or 2.0 * linear
        ),
        angular=AxisLimits(
            max_velocity=angular, max_acceleration=drive.max_angular_acceleration or 3.0 * angular
        ),
        max_wheel_velocity=min(_fastest(description, joint) for joint in wheels),
    )


def _fastest(description: RobotDescription, wheel: str) -> float:
    """Return how fast a wheel may turn either way, by its joint's limit and its command's [rad/s]."""
    command, limit = description.commands.get(wheel), description.joints[wheel].limit.velocity
    if command is None or command.interface != "velocity":
        return limit or math.inf
    return min(
        speed for speed in (limit, command.upper, -(command.lower or 0.0), math.inf) if speed and speed > 0
    )


def analytic_track_ratio(
    drive: DriveSpec, description: RobotDescription, *, equal_loads: bool = False
) -> float:
    """Return effective over geometric track; not 1 for a skid steer, see `track_ratio`.

    Args:
        drive: The drive of `description`.
        description: The robot; where its centre of mass is decides about the loads of its wheels.
        equal_loads: Take them as equal all the same; four wheels then have 1 + (a/b)².
    """
    if drive.kind == "diff_drive":
        return 1.0
    wheels, is_left, centre = _stance(drive, description)
    shares = None if equal_loads else weight_shares(wheels[:, :2], centre[:2])
    return track_ratio(wheels[:, :2], is_left, drive.wheel_separation, shares)


def odometry_noise(drive: DriveSpec, description: RobotDescription) -> OdometryNoise:
    """Return how wrong the odometry of a robot's wheels is: cornering slip follows from its geometry."""
    if drive.kind == "diff_drive":
        return DIFF_DRIVE
    wheels, is_left, centre = _stance(drive, description)
    given = (description.links[description.joints[name].child].surface.friction for name in drive.left_joints)
    friction = max(next((value for value in given if value is not None), 1.0), _LEAST_FRICTION)
    height = float(centre[2] - wheels[:, 2].mean() + drive.wheel_radius)
    shares = weight_shares(wheels[:, :2], centre[:2])
    slip = cornering_slip(wheels[:, :2], is_left, shares, height, friction)
    return replace(
        SKID_STEER, side_shift=slip.side_shift, turn_gain=slip.turn_gain, grip=friction * STANDARD_GRAVITY
    )


def _stance(drive: DriveSpec, description: RobotDescription) -> tuple[Array, list[bool], Array]:
    """Return the wheels' centres, shape (n, 3), which are on the left, and the centre of mass, shape (3,)."""
    poses = link_poses(description)
    joints = (*drive.left_joints, *drive.right_joints)
    wheels = np.array([poses[description.joints[name].child].xyz for name in joints])
    is_left = [True] * len(drive.left_joints) + [False] * len(drive.right_joints)
    masses = [
        (link.inertial.mass, poses[name].apply(link.inertial.T_link_com.xyz))
        for name, link in description.links.items()
        if link.inertial is not None
    ]
    mass = np.array([mass for mass, _ in masses])
    return wheels, is_left, np.asarray(mass @ np.array([point for _, point in masses]) / mass.sum())
