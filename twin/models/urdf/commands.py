"""How joints are commanded: command and state interfaces of `<ros2_control>`, and `<transmission>`.

`<ros2_control>` as on control.ros.org (ros2_control's URDF). `<transmission>` of ros_control and of the PR2
says which joint a motor drives: spellings as in ros_control's transmission_parser.cpp (element <type>,
<hardwareInterface> of the joint or, as it was first, of the actuator, with or without its package) and in
the PR2's files (type=, effort alone).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import get_args

from twin.errors import nearest
from twin.models.description import Joint
from twin.models.kinematics import ONE_DOF
from twin.models.specs import CommandSpec, Interface
from twin.models.urdf.document import Element, Report, text_of
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


HARDWARE: Mapping[str, Interface] = {
    "EffortJointInterface": "effort",
    "VelocityJointInterface": "velocity",
    "PositionJointInterface": "position",
    "PosVelJointInterface": "position",
    "PosVelAccJointInterface": "position",
}
SIMPLE = "SimpleTransmission"
PR2 = "pr2_mechanism_model"


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """One `<transmission>` and what becomes of it."""

    element: Element
    joint: str | None
    """The joint that it commands; None if it has no effect."""
    interface: Interface | None
    interfaces: tuple[str, ...]
    """All hardware interfaces that it names, without their package."""
    reduction: float
    fault: str
    """Why it has no effect; empty if it has one."""


def transmissions(root: Element, joints: Mapping[str, Joint]) -> Iterator[Transmission]:
    """Yield every `<transmission>` below `<robot>` in file order."""
    for element in root.findall("transmission"):
        spelled = text_of(element, "type") or element.get("type", "")
        kind = spelled.rpartition("/")[2]
        names = [joint.get("name", "") for joint in element.findall("joint")]
        interfaces = tuple(map(hardware_interface, element.iter("hardwareInterface")))
        interface = next((HARDWARE[name] for name in interfaces if name in HARDWARE), None)
        if interface is None and not interfaces and PR2 in spelled:
            interface = "effort"
        reduction = number_in(next(element.iter("mechanicalReduction"), None))
        fault = _fault(kind, names, interface, interfaces, joints)
        yield Transmission(
            element=element,
            joint=None if fault else names[0],
            interface=None if fault else interface,
            interfaces=interfaces,
            reduction=1.0 if reduction is None else reduction,
            fault=fault,
        )


def hardware_interface(element: Element) -> str:
    """Return the text of a `<hardwareInterface>`, without its package."""
    return str((element.text or "").strip().rpartition("/")[2])


def read_transmissions(
    root: Element, joints: Mapping[str, Joint], report: Report, commands: Mapping[str, CommandSpec]
) -> dict[str, CommandSpec]:
    """Return `commands` and the joints that only a `<transmission>` commands."""
    known = dict(commands)
    spoken_of = {element.get("name") for element in root.iterfind("ros2_control/joint")}
    for item in transmissions(root, joints):
        if item.joint is None or item.interface is None or item.joint in spoken_of:
            continue
        spec = CommandSpec(joint=item.joint, interface=item.interface, line=report.line(item.element))
        known.setdefault(item.joint, spec)
    return known


def _fault(
    kind: str,
    names: list[str],
    interface: Interface | None,
    interfaces: tuple[str, ...],
    joints: Mapping[str, Joint],
) -> str:
    if kind != SIMPLE:
        return f"its type is {kind or 'not given'}; only {SIMPLE} has an effect"
    if len(names) != 1:
        return f"it names {len(names)} joints, not one"
    joint = joints.get(names[0])
    if joint is None:
        return f"joint '{names[0]}' does not exist"
    if joint.type not in ONE_DOF:
        return f"joint '{names[0]}' is {joint.type}"
    if joint.mimic is not None:
        return f"joint '{names[0]}' follows '{joint.mimic.joint}'"
    if interface is None:
        named = ", ".join(interfaces)
        fault = f"its hardware interface {named} commands nothing"
        return fault if named else "it has no <hardwareInterface>"
    return ""
