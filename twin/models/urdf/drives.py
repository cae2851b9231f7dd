"""Wheeled drives, from the diff-drive and skid-steer plugins of classic Gazebo (ROS 1 and 2) and new Gazebo.

Element names: gz-sim DiffDrive system, gazebo_ros_pkgs diff_drive and skid_steer_drive.
"""

from __future__ import annotations

from collections.abc import Mapping

from twin.errors import nearest
from twin.models.description import Joint
from twin.models.specs import DriveSpec
from twin.models.urdf.document import Element, Report, text_of

DIFF_DRIVE = ("libgazebo_ros_diff_drive.so", "gz-sim-diff-drive-system", "ignition-gazebo-diff-drive-system")
SKID_STEER = ("libgazebo_ros_skid_steer_drive.so",)
LEFT = ("left_joint", "leftJoint", "leftFrontJoint", "leftRearJoint")
RIGHT = ("right_joint", "rightJoint", "rightFrontJoint", "rightRearJoint")
TORQUES = ("max_wheel_torque", "wheelTorque", "torque")
GEOMETRY = (
    "wheel_separation",
    "wheelSeparation",
    "wheel_radius",
    "wheel_diameter",
    "wheelDiameter",
)
SPEEDS = ("max_velocity", "max_linear_velocity", "max_angular_velocity")
ACCELERATIONS = ("max_acceleration", "max_linear_acceleration", "max_angular_acceleration")
FRAMES = (
    "frame_id",
    "odometry_frame",
    "odometryFrame",
    "child_frame_id",
    "robot_base_frame",
    "robotBaseFrame",
)
CONTROLLER = (*GEOMETRY, *SPEEDS, *ACCELERATIONS, *FRAMES)
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
        report.add(
            plugin, f"the drive plugin names joint '{name}' twice; each wheel is named once", code="bad-drive"
        )
    separation, radius = _geometry(plugin, report)
    torque = report.child_number(plugin, *TORQUES)
    if torque is not None and torque < 0.0:
        report.add(
            plugin, f"the drive plugin has wheel torque {torque:g} Nm; give a magnitude", code="bad-drive"
        )
    return DriveSpec(
        kind="skid_steer" if len(left) > 1 or _names(plugin, SKID_STEER) else "diff_drive",
        left_joints=left,
        right_joints=right,
        wheel_separation=separation or 1.0,
        wheel_radius=radius or 1.0,
        max_wheel_torque=_wheel_effort(left + right, joints) if torque is None else torque,
        max_linear_velocity=report.child_number(plugin, "max_linear_velocity", "max_velocity"),
        max_linear_acceleration=report.child_number(plugin, "max_linear_acceleration", "max_acceleration"),
        max_angular_velocity=report.child_number(plugin, "max_angular_velocity", "max_velocity"),
        max_angular_acceleration=report.child_number(plugin, "max_angular_acceleration", "max_acceleration"),
        odometry_frame=text_of(plugin, "frame_id", "odometry_frame", "odometryFrame") or "odom",
        base_frame=text_of(plugin, "child_frame_id", "robot_base_frame", "robotBaseFrame")
        or "base_footprint",
        line=report.line(plugin),
    )


def is_drive(plugin: Element) -> bool:
    """Tell whether a plugin is a differential or skid-steer drive."""
    return _names(plugin, DIFF_DRIVE + SKID_STEER) or plugin.get("name", "").endswith("::systems::DiffDrive")


def library_of(plugin: Element) -> str:
    """Return the file name of a plugin's library, without folder, `lib` and `.so`; empty if it has none."""
    filename = str(plugin.get("filename", "")).rsplit("/", 1)[-1]
    return filename.removeprefix("lib").removesuffix(".so")


def _names(plugin: Element, libraries: tuple[str, ...]) -> bool:
    return library_of(plugin) in {library.removeprefix("lib").removesuffix(".so") for library in libraries}


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
        if joint not in joints:
            report.add(
                child,
                f"the drive plugin names joint '{joint}', which does not exist; {nearest(joint, joints)}",
                code="bad-drive",
            )
        elif joints[joint].type not in ("continuous", "revolute"):
            report.add(
                child,
                f"the drive plugin names joint '{joint}', which is {joints[joint].type}, not continuous",
                code="bad-drive",
            )
        found.append(joint)
    if not found:
        report.add(plugin, f"the drive plugin has no <{names[0]}>", code="bad-drive")
    return tuple(found)


def _wheel_effort(names: tuple[str, ...], joints: Mapping[str, Joint]) -> float | None:
    efforts = [joints[name].limit.effort for name in names if name in joints]
    known = [effort for effort in efforts if effort is not None]
    return min(known) if known else None
