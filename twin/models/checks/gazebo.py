"""What a robot file asks of Gazebo or ros_control that is not simulated."""

from __future__ import annotations

from collections.abc import Iterator

from twin.errors import nearest
from twin.models.checks.diagnostic import Diagnostic, finding, finding_in, read_source
from twin.models.description import RobotDescription
from twin.models.sensors import SENSORS, plugin_of
from twin.models.urdf.batteries import ELEMENTS, IN_ANY_CASE, batteries, is_battery
from twin.models.urdf.cameras import CAMERA, lenses
from twin.models.urdf.commands import HARDWARE, INTERFACES, command_interface, transmissions
from twin.models.urdf.document import Element, Report, first
from twin.models.urdf.drives import is_drive, library_of
from twin.models.urdf.gazebo import MU1, MU2, NUMBERS, extensions_of, number_in, value_of
from twin.models.urdf.sensors import PLUGIN_IMU, kind_of

OWN_PLUGINS = ("joint_state_publisher", "joint-state-publisher-system", "_control", "_control-system")
"""Ends of the names of libraries whose work twin's own nodes do: joint states, and running controllers."""
WORLD_PLUGINS = ("sensors-system", "imu-system", "contact-system")
"""Of new Gazebo, which has to be told to simulate sensors at all."""


Found = tuple[str, Element, str, str]
"""Code, element, message and fix."""


def gazebo(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield plugins, sensors, transmissions and values that have no effect, or another one than in Gazebo."""
    root, report = read_source(description)
    for code, element, message, fix in _found(root, description):
        yield finding_in(report, code, element, message, fix)
    yield from _transmissions(root, description, report)


def _found(root: Element, description: RobotDescription) -> Iterator[Found]:
    for element in root.findall("gazebo"):
        name = element.get("reference", "").strip()
        if name and name not in description.links and name not in description.joints:
            yield _unknown_reference(element, name, description)
            continue
        for plugin in element.findall("plugin"):
            yield from _plugin(plugin)
        for sensor in element.findall("sensor"):
            yield from _sensor(sensor, name, description)
    for element in root.findall("sensor"):
        # wiki.ros.org/urdf/XML/sensor is a proposal: urdfdom can parse it, no simulator reads it.
        name = element.get("name", "")
        message = f"sensor '{name}' stands directly under <robot>, where no simulator reads it"
        yield "not-simulated", element, message, "put it into <gazebo reference='LINK'>, as SDF has it"
    for name, element in extensions_of(root):
        yield from _values(element, name)
    for joint in root.iterfind("ros2_control/joint"):
        named = [interface.get("name", "") for interface in joint.findall("command_interface")]
        counts = command_interface(joint)
        if len(named) > 1 and counts is not None and counts.get("name") in INTERFACES:
            yield _several(joint, joint.get("name", ""), named, counts.get("name"))


def _unknown_reference(element: Element, name: str, description: RobotDescription) -> Found:
    joints = element.find("sensor[@type='force_torque']") is not None
    known = description.joints if joints else [*description.links, *description.joints]
    hint = nearest(name, known).partition(" Valid:")[0]
    fix = hint.lower() if hint.startswith("did") else "name an existing link or joint, or remove it"
    message = f"<gazebo> extends '{name}', which is neither a link nor a joint"
    return "unknown-reference", element, message, fix


def _plugin(plugin: Element) -> Iterator[Found]:
    library, name = library_of(plugin), plugin.get("name", "")
    if is_battery(plugin):
        yield from _battery(plugin)
        return
    if is_drive(plugin) or library == PLUGIN_IMU:
        return
    if library.endswith((*OWN_PLUGINS, *WORLD_PLUGINS)):
        return
    what = name.rpartition("::")[2] if "::" in name else (library or name)
    fix = "drives are DiffDrive and skid steer; give joints a <command_interface>, followers a <mimic>"
    yield "not-simulated", plugin, f"plugin '{what}' is not simulated", fix


def _battery(plugin: Element) -> Iterator[Found]:
    if next(batteries(plugin.getroottree().getroot())) is not plugin:
        fix = "leave the one that powers the robot"
        yield "not-simulated", plugin, "another battery plugin stands before; the first counts", fix
        return
    for child in plugin.iterchildren("*"):
        if child.tag not in (*ELEMENTS, *IN_ANY_CASE):
            message = f"<{child.tag}> of the battery plugin has no effect"
            fix = "docks that are chargers charge it, and its load is always on; see docs/robots.md"
            yield "not-simulated", child, message, fix


def _sensor(sensor: Element, link: str, description: RobotDescription) -> Iterator[Found]:
    kind, name = kind_of(sensor), sensor.get("name", "")
    what = f"sensor '{name}' of type {kind or 'unknown'}"
    if kind in CAMERA:
        yield from _camera(sensor, link, what)
    elif kind not in SENSORS.names():
        fix = f"twin has {', '.join(SENSORS.names())} and cameras"
        yield "not-simulated", sensor, f"{what} is not simulated", fix
    elif (plugin := SENSORS.find(kind)).ships:
        for fault, fix in plugin.load().unlike_gazebo(sensor):
            yield "not-simulated", sensor, f"{what} {fault}", fix
    for spec in description.sensors:
        moved = any(spec.T_link_sensor.xyz) or abs(spec.T_link_sensor.quat_wxyz[0]) < 1.0
        mine = spec.link == link and spec.name in (name, f"{link}_{name}")
        if mine and moved and plugin_of(spec).load().at_origin:
            message = (
                f"the <pose> of sensor '{name}' holds in robot.xml; twin's own simulation samples it at "
                f"the origin of link '{link}'"
            )
            yield "not-simulated", sensor, message, "give the sensor a link of its own, fixed where it is"


def _camera(sensor: Element, link: str, what: str) -> Iterator[Found]:
    if not any(lenses(sensor)):
        yield "not-simulated", sensor, f"{what} has no <camera>", "add <camera>"
    if "optical" in link:
        message = f"{what} looks along +x of '{link}', which looks by its name along +z"
        fix = "put it on the camera's link, and name the optical frame in <optical_frame_id>"
        yield "camera-frame", sensor, message, fix


def _values(element: Element, name: str) -> Iterator[Found]:
    for child in (found for path in NUMBERS if (found := element.find(path)) is not None):
        if number_in(child) is None:
            message = f"<{child.tag}> of '{name}' is '{value_of(child)}', no number, and has no effect"
            yield "ignored-value", child, message, "write a number between the tags, or remove it"
    mu1, mu2 = (number_in(first(element, *paths)) for paths in (MU1, MU2))
    if mu1 is not None and mu2 is not None and mu1 != mu2:
        message = f"mu2 {mu2:g} of link '{name}': friction is the same in every direction, here mu1 {mu1:g}"
        yield "not-simulated", element, message, "give both the same value"


def _transmissions(root: Element, description: RobotDescription, report: Report) -> Iterator[Diagnostic]:
    for item in transmissions(root, description.joints):
        named = list(dict.fromkeys(name for name in item.interfaces if name in HARDWARE))
        title = f"transmission '{item.element.get('name', '')}'"
        if item.fault and "commands nothing" not in item.fault:
            message = f"{title} has no effect: {item.fault}"
            fix = "to command a joint that moves, give it a <command_interface> in <ros2_control>"
            yield finding(report, "not-simulated", title, report.line(item.element), message, fix)
        elif item.joint and len(named) > 1:
            yield finding_in(report, *_several(item.element, item.joint, named, item.interface or ""))


def _several(element: Element, joint: str, named: list[str], counts: str) -> Found:
    message = f"joint '{joint}' has the command interfaces {', '.join(named)}; {counts} counts"
    return "several-interfaces", element, message, "leave the one that is used"
