"""Wheeled drives, from the diff-drive and skid-steer plugins of classic Gazebo (ROS 1 and 2) and new Gazebo.

Element names: gz-sim DiffDrive system, gazebo_ros_pkgs diff_drive and skid_steer_drive.
"""

from __future__ import annotations

from collections.abc import Mapping

from twin.errors import nearest
from twin.models.description import Joint
from twin.models.specs import DriveSpec
from twin.models.urdf.document import Element, Report, text_of

DIFF_DRIVE = ("gazebo_ros_diff_drive", "gz-sim-diff-drive-system", "ignition-gazebo-diff-drive-system")
SKID_STEER = "gazebo_ros_skid_steer_drive"
LEFT = ("left_joint", "leftJoint", "leftFrontJoint", "leftRearJoint")
RIGHT = ("right_joint", "rightJoint", "rightFrontJoint", "rightRearJoint")
TORQUES = ("max_wheel_torque", "wheelTorque", "torque")
GEOMETRY = ("wheel_separation", "wheelSeparation", "wheel_radius", "wheel_diameter", "wheelDiameter")
SPEEDS = ("max_velocity", "max_linear_velocity", "max_angular_velocity")
ACCELERATIONS = ("max_acceleration", "max_linear_acceleration", "max_angular_acceleration")
ODOMETRY_FRAME = ("frame_id", "odometry_frame", "odometryFrame")
BASE_FRAME = ("child_frame_id", "robot_base_frame", "robotBaseFrame")
CONTROLLER = (*GEOMETRY, *SPEEDS, *ACCELERATIONS, *ODOMETRY_FRAME, *BASE_FRAME)
"""What twin's drive controller takes from the plugin."""


def read_drive(root: Element, joints: Mapping[str, Joint], report: Report) -> DriveSpec | None:
    """Return the wheeled drive of the robot, or None if no plugin describes one."""
    plugins = [plugin for plugin in root.iterfind("gazebo/plugin") if is_drive(plugin)]
    if not plugins:
        return None
    if len(plugins) > 1:
        report.add(plugins[1], "the robot has two drive plugins; one is allowed", code="bad-drive")
    plugin = plugins[0]
    left, right = (_wheel_joints(plugin, names, joints, report) for names in (LEFT, RIGHT))
    for name in dict.fromkeys(name for name in left + right if (left + right).count(name) > 1):
        message = f"the drive plugin names joint '{name}' twice; each wheel is named once"
        report.add(plugin, message, code="bad-drive")
    separation, radius = _geometry(plugin, report)
    torque = report.child_number(plugin, *TORQUES)
    if torque is not None and torque < 0.0:
        message = f"the drive plugin has wheel torque {torque:g} Nm; give a magnitude"
        report.add(plugin, message, code="bad-drive")
    return DriveSpec(
        kind="skid_steer" if len(left) > 1 or library_of(plugin) == SKID_STEER else "diff_drive",
        left_joints=left,
        right_joints=right,
        wheel_separation=separation or 1.0,
        wheel_radius=radius or 1.0,
        max_wheel_torque=_wheel_effort(left + right, joints) if torque is None else torque,
        max_linear_velocity=report.child_number(plugin, "max_linear_velocity", "max_velocity"),
        max_linear_acceleration=report.child_number(plugin, "max_linear_acceleration", "max_acceleration"),
        max_angular_velocity=report.child_number(plugin, "max_angular_velocity", "max_velocity"),
        max_angular_acceleration=report.child_number(plugin, "max_angular_acceleration", "max_acceleration"),
        odometry_frame=text_of(plugin, *ODOMETRY_FRAME) or "odom",
        base_frame=text_of(plugin, *BASE_FRAME) or "base_footprint",
        line=report.line(plugin),
    )


def is_drive(plugin: Element) -> bool:
    """Tell whether a plugin is a differential or skid-steer drive."""
    known = library_of(plugin) in (*DIFF_DRIVE, SKID_STEER)
    return known or plugin.get("name", "").endswith("::systems::DiffDrive")


def library_of(plugin: Element) -> str:
    """Return the file name of a plugin's library, without folder, `lib` and `.so`; empty if it has none."""
    filename = str(plugin.get("filename", "")).rsplit("/", 1)[-1]
    return filename.removeprefix("lib").removesuffix(".so")


def _geometry(plugin: Element, report: Report) -> tuple[float | None, float | None]:
    """Return the distance of the wheels and their radius [m]."""
    separation = report.child_number(plugin, "wheel_separation", "wheelSeparation")
    radius = report.child_number(plugin, "wheel_radius")
    diameter = report.child_number(plugin, "wheel_diameter", "wheelDiameter")
    if radius is None and diameter is not None:
        radius = diameter / 2.0
    for what, value in (("wheel_separation", separation), ("wheel_radius", radius)):
        if value is None or value <= 0.0:
            report.add(plugin, f"the drive plugin needs a positive <{what}> [m]", code="bad-drive")
    return separation, radius


def _wheel_joints(
    plugin: Element, names: tuple[str, ...], joints: Mapping[str, Joint], report: Report
) -> tuple[str, ...]:
    found: list[str] = []
    for child in plugin:
        if child.tag not in names:
            continue
        joint = (child.text or "").strip()
        fault = ""
        if joint not in joints:
            fault = f"does not exist; {nearest(joint, joints)}"
        elif joints[joint].type not in ("continuous", "revolute"):
            fault = f"is {joints[joint].type}, not continuous"
        if fault:
            report.add(child, f"the drive plugin names joint '{joint}', which {fault}", code="bad-drive")
        found.append(joint)
    if not found:
        report.add(plugin, f"the drive plugin has no <{names[0]}>", code="bad-drive")
    return tuple(found)


def _wheel_effort(names: tuple[str, ...], joints: Mapping[str, Joint]) -> float | None:
    efforts = (joints[name].limit.effort for name in names if name in joints)
    return min((effort for effort in efforts if effort is not None), default=None)
