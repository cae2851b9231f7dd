"""Drive, contact and command elements: `<gazebo>` (classic and new Gazebo) and `<ros2_control>`.

Element names: gz-sim DiffDrive system, gazebo_ros_pkgs diff_drive and skid_steer_drive, ros2_control's URDF.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from twin.errors import nearest
from twin.models.description import CommandSpec, DriveSpec, Joint, Surface
from twin.models.document import Element, Report, first, text_of

DIFF_DRIVE = ("libgazebo_ros_diff_drive.so", "gz-sim-diff-drive-system", "ignition-gazebo-diff-drive-system")
SKID_STEER = ("libgazebo_ros_skid_steer_drive.so",)
LEFT = ("left_joint", "leftJoint", "leftFrontJoint", "leftRearJoint")
RIGHT = ("right_joint", "rightJoint", "rightFrontJoint", "rightRearJoint")
Interface = Literal["position", "velocity", "effort"]
INTERFACES: tuple[str, ...] = get_args(Interface)


def read_surfaces(root: Element, report: Report) -> dict[str, Surface]:
    """Return the contact parameters of links, from `<gazebo reference='link'><mu1>`."""
    surfaces: dict[str, Surface] = {}
    for element in root.findall("gazebo"):
        link = element.get("reference")
        friction = report.child_number(element, "mu1", "collision/surface/friction/ode/mu") if link else None
        if friction is None:
            continue
        if friction < 0.0:
            report.add(
                element,
                f"mu1 of link '{link}' is {friction:g}; friction is not negative",
                code="bad-friction",
            )
            continue
        surfaces[link] = Surface(friction=friction, line=report.line(element))
    return surfaces


def read_drive(root: Element, joints: Mapping[str, Joint], report: Report) -> DriveSpec | None:
    """Return the wheeled drive of the robot, or None if no plugin describes one."""
    plugins = [plugin for plugin in root.iterfind("gazebo/plugin") if _is_drive(plugin)]
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
    separation = report.child_number(plugin, "wheel_separation", "wheelSeparation")
    radius = report.child_number(plugin, "wheel_radius")
    diameter = report.child_number(plugin, "wheel_diameter", "wheelDiameter")
    if radius is None and diameter is not None:
        radius = diameter / 2.0
    for what, value in (("wheel_separation", separation), ("wheel_radius", radius)):
        if value is None or value <= 0.0:
            report.add(plugin, f"the drive plugin needs a positive <{what}> [m]", code="bad-drive")
    torque = report.child_number(plugin, "max_wheel_torque", "wheelTorque", "torque")
    return DriveSpec(
        kind="skid_steer" if len(left) > 1 or _names(plugin, SKID_STEER) else "diff_drive",
        left_joints=left,
        right_joints=right,
        wheel_separation=separation or 1.0,
        wheel_radius=radius or 1.0,
        max_wheel_torque=_wheel_effort(left + right, joints) if torque is None else torque,
        max_linear_velocity=report.child_number(plugin, "max_linear_velocity"),
        max_linear_acceleration=report.child_number(plugin, "max_linear_acceleration"),
        max_angular_velocity=report.child_number(plugin, "max_angular_velocity"),
        max_angular_acceleration=report.child_number(plugin, "max_angular_acceleration"),
        odometry_frame=text_of(plugin, "frame_id", "odometry_frame", "odometryFrame") or "odom",
        base_frame=text_of(plugin, "child_frame_id", "robot_base_frame", "robotBaseFrame")
        or "base_footprint",
        line=report.line(plugin),
    )


def read_commands(root: Element, joints: Mapping[str, Joint], report: Report) -> dict[str, CommandSpec]:
    """Return how joints are commanded, from `<ros2_control><joint><command_interface>`, by joint."""
    commands: dict[str, CommandSpec] = {}
    for element in root.iterfind("ros2_control/joint"):
        name = report.required(element, "name")
        interface = first(element, "command_interface")
        if interface is None or not name:
            continue
        kind = interface.get("name", "")
        if kind not in INTERFACES:
            report.add(
                interface,
                f"command interface '{kind}' of joint '{name}': {nearest(kind, INTERFACES)}",
                code="bad-command",
            )
            continue
        if name not in joints:
            report.add(
                element,
                f"<ros2_control> commands joint '{name}', which does not exist; {nearest(name, joints)}",
                code="bad-command",
            )
        elif joints[name].mimic is not None:
            report.add(
                element,
                f"<ros2_control> commands joint '{name}', which mimics another; command its leader",
                code="bad-command",
            )
        elif joints[name].type == "fixed":
            report.add(element, f"<ros2_control> commands joint '{name}', which is fixed", code="bad-command")
        commands[name] = CommandSpec(joint=name, interface=kind, line=report.line(element))
    return commands


def _is_drive(plugin: Element) -> bool:
    return _names(plugin, DIFF_DRIVE + SKID_STEER) or plugin.get("name", "").endswith("::systems::DiffDrive")


def _names(plugin: Element, libraries: tuple[str, ...]) -> bool:
    filename = plugin.get("filename", "").rsplit("/", 1)[-1]
    return filename in libraries or filename.removeprefix("lib").removesuffix(".so") in libraries


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
