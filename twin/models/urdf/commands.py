"""Command and state interfaces of joints, from `<ros2_control>` (control.ros.org, ros2_control's URDF)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

from twin.errors import nearest
from twin.models.description import Joint
from twin.models.kinematics import ONE_DOF
from twin.models.specs import CommandSpec, Interface
from twin.models.urdf.document import Element, Report
from twin.models.urdf.gazebo import number_in

INTERFACES: tuple[str, ...] = get_args(Interface)


def read_commands(root: Element, joints: Mapping[str, Joint], report: Report) -> dict[str, CommandSpec]:
    """Return how joints are commanded, from `<ros2_control><joint><command_interface>`, by joint."""
    commands: dict[str, CommandSpec] = {}
    for element in root.iterfind("ros2_control/joint"):
        name = report.required(element, "name")
        interface = command_interface(element)
        if interface is None or not name:
            continue
        kind = interface.get("name", "")
        if kind not in INTERFACES:
            message = f"command interface '{kind}' of joint '{name}': {nearest(kind, INTERFACES)}"
            report.add(interface, message, code="bad-command")
            continue
        fault = ""
        if name not in joints:
            fault = f"does not exist; {nearest(name, joints)}"
        elif joints[name].mimic is not None:
            fault = "mimics another; command its leader"
        elif joints[name].type not in ONE_DOF:
            fault = f"is {joints[name].type}"
        if fault:
            message = f"<ros2_control> commands joint '{name}', which {fault}"
            report.add(element, message, code="bad-command")
        lower, upper = (_param(interface, bound) for bound in ("min", "max"))
        spec = CommandSpec(joint=name, interface=kind, lower=lower, upper=upper, line=report.line(element))
        commands.setdefault(name, spec)
    return commands


def command_interface(joint: Element) -> Element | None:
    """Return the command interface of a `<ros2_control><joint>` that counts: the first that MuJoCo has."""
    found = joint.findall("command_interface")
    known = [interface for interface in found if interface.get("name") in INTERFACES]
    return next(iter([*known, *found]), None)


def read_states(root: Element, joints: Mapping[str, Joint]) -> dict[str, tuple[Interface, ...]]:
    """Return which states `<ros2_control>` reads of hinges and slides, by joint."""
    states: dict[str, tuple[Interface, ...]] = {}
    for element in root.iterfind("ros2_control/joint"):
        joint = joints.get(element.get("name", ""))
        if joint is None or joint.type not in ONE_DOF:
            continue
        names = [interface.get("name") for interface in element.findall("state_interface")]
        known = tuple(name for name in get_args(Interface) if name in names)
        if known:
            states.setdefault(joint.name, known)
    return states


def _param(interface: Element, name: str) -> float | None:
    for param in interface.findall("param"):
        if param.get("name") == name:
            return number_in(param)
    return None
