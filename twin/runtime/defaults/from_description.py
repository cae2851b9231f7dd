"""What nodes need to know of a robot, read off its description: footprint, wheels and arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.errors import ModelError
from twin.geometry import Array, Pose3
from twin.manipulation.telescopic_arm import TelescopicArm, TelescopicArmConfig
from twin.manipulation.trajectory import JointLimits
from twin.models.description import Joint, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.shapes import Box, Capsule, Cylinder, Sphere
from twin.sensors.lidar import LidarSpec

GRASP_FRAME = "grasp_frame"
"""Link between the fingers of a robot that can grasp."""
SCAN = "scan"
"""Topic of the lidar that maps are made from, and by which robots drive."""

_ARM_ACCELERATION = 1.0
"""Of arm joints [m/s² or rad/s²]; URDF has no such limit."""


def footprint(description: RobotDescription, *, padding: float = 0.01) -> Array:
    """Return the rectangle about all collision shapes at zero joint positions, as corners in the root frame.

    Args:
        description: The robot.
        padding: Added on every side [m].

    Returns:
        Shape (4, 2) [m].
    """
    poses = link_poses(description)
    corners = [
        (poses[link.name] @ collision.T_link_geometry).apply(_corners(collision.geometry))
        for link in description.links.values()
        for collision in link.collisions
    ]
    if not corners:
        raise ModelError(
            f"{description.source}: robot '{description.name}' has no collision shape to drive with"
        )
    points = np.concatenate(corners)
    (x0, y0), (x1, y1) = points[:, :2].min(axis=0) - padding, points[:, :2].max(axis=0) + padding
    return np.array([[x1, y1], [x0, y1], [x0, y0], [x1, y0]])


def wheels(description: RobotDescription) -> frozenset[str]:
    """Return the joints on which a robot rolls: those of its drive, and those that turn freely with it.

    The latter are continuous joints that nobody commands, such as a caster's two.
    """
    drive = description.drive
    if drive is None:
        return frozenset()
    free = (
        joint.name
        for joint in description.joints.values()
        if joint.type == "continuous" and joint.name not in description.commands and joint.mimic is None
    )
    return frozenset((*drive.left_joints, *drive.right_joints, *free))


def scan_lidar(description: RobotDescription) -> LidarSpec | None:
    """Return the lidar on `scan`, if the robot has it."""
    return next((s for s in description.sensors if isinstance(s, LidarSpec) and s.topic == SCAN), None)


def _corners(geometry: object) -> Array:
    match geometry:
        case Box(size=size):
            half = np.array(size) / 2.0
        case Cylinder(radius=radius, length=length):
            half = np.array([radius, radius, length / 2.0])
        case Capsule(radius=radius, length=length):
            half = np.array([radius, radius, length / 2.0 + radius])
        case Sphere(radius=radius):
            half = np.full(3, radius)
        case _:
            return np.zeros((1, 3))
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).T.reshape(-1, 3)
    return np.asarray(signs * half)


@dataclass(frozen=True, kw_only=True)
class Manipulator:
    """A telescopic arm with its gripper."""

    arm: TelescopicArm
    arm_joints: tuple[str, ...]
    gripper_joint: str
    gripper_open: float
    """Position of the finger joint, fully open [m]."""
    finger_links: tuple[str, ...]


def manipulator(description: RobotDescription) -> Manipulator | None:
    """Return the arm that carries the grasp frame: a lift, a telescopic extension and a wrist.

    None for a robot without a grasp frame or without these joints.
    """
    if GRASP_FRAME not in description.links:
        return None
    poses = link_poses(description)
    chain = _chain(description, GRASP_FRAME)
    commanded = [joint for joint in chain if joint.name in description.commands]
    axes = {joint.name: _axis(joint, poses) for joint in chain}
    lift = [j for j in commanded if j.type == "prismatic" and abs(axes[j.name][2]) > 0.99]
    extension = [j for j in commanded if j.type == "prismatic" and abs(axes[j.name][0]) > 0.99]
    wrist = [j for j in commanded if j.type == "revolute" and abs(axes[j.name][2]) > 0.99]
    gripper = [
        description.joints[name]
        for name in description.commands
        if name not in {joint.name for joint in chain} and description.joints[name].type == "prismatic"
    ]
    if not (lift and extension and wrist and gripper):
        return None
    followers = [j for j in chain if j.mimic is not None and j.mimic.joint == extension[0].name]
    ratio = 1.0 + sum(j.mimic.multiplier for j in followers if j.mimic is not None)
    wrist_pose, grasp_pose = poses[wrist[0].child], poses[GRASP_FRAME]
    joints = (lift[0], extension[0], wrist[0])
    fingers = [gripper[0]] + [
        j for j in description.joints.values() if j.mimic is not None and j.mimic.joint == gripper[0].name
    ]
    return Manipulator(
        arm=TelescopicArm(
            TelescopicArmConfig(
                lift_joint=lift[0].name,
                extension_joint=extension[0].name,
                wrist_joint=wrist[0].name,
                extension_ratio=ratio,
                wrist_x=float(wrist_pose.xyz[0]),
                grasp_z=float(grasp_pose.xyz[2]),
                grasp_length=float(np.hypot(*(grasp_pose.xyz - wrist_pose.xyz)[:2])),
            ),
            {joint.name: _limits(joint) for joint in joints},
        ),
        arm_joints=tuple(joint.name for joint in joints),
        gripper_joint=gripper[0].name,
        gripper_open=gripper[0].limit.upper or 0.0,
        finger_links=tuple(joint.child for joint in fingers),
    )


def _chain(description: RobotDescription, tip: str) -> list[Joint]:
    parents = {joint.child: joint for joint in description.joints.values()}
    chain: list[Joint] = []
    link = tip
    while link in parents:
        chain.insert(0, parents[link])
        link = parents[link].parent
    return chain


def _axis(joint: Joint, poses: dict[str, Pose3]) -> Array:
    pose = poses[joint.child]
    return pose.apply(np.asarray(joint.axis)) - pose.xyz


def _limits(joint: Joint) -> JointLimits:
    return JointLimits(
        lower=joint.limit.lower if joint.limit.lower is not None else -np.inf,
        upper=joint.limit.upper if joint.limit.upper is not None else np.inf,
        max_velocity=joint.limit.velocity or 0.5,
        max_acceleration=_ARM_ACCELERATION,
    )
