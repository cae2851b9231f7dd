"""The drive controller's numbers, read off a robot's description."""

from __future__ import annotations

from twin.controllers.diff_drive import DiffDriveConfig
from twin.controllers.limiter import AxisLimits
from twin.controllers.skid_steer import track_ratio
from twin.models.description import DriveSpec, RobotDescription
from twin.models.kinematics import link_poses


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
    joints = (description.joints[name] for name in (*drive.left_joints, *drive.right_joints))
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
        max_wheel_velocity=min(joint.limit.velocity or float("inf") for joint in joints),
    )


def analytic_track_ratio(drive: DriveSpec, description: RobotDescription) -> float:
    """Return effective over geometric track; not 1 for a skid steer, see `track_ratio`."""
    if drive.kind == "diff_drive":
        return 1.0
    poses = link_poses(description)
    wheels = [poses[description.joints[name].child].xyz[:2] for name in drive.left_joints]
    wheels += [poses[description.joints[name].child].xyz[:2] for name in drive.right_joints]
    is_left = [True] * len(drive.left_joints) + [False] * len(drive.right_joints)
    return track_ratio(wheels, is_left, drive.wheel_separation)
