"""What a robot file asks of Gazebo or ros_control that is not simulated."""

from __future__ import annotations

from collections.abc import Iterator

from twin.errors import nearest
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.source import read_source
from twin.models.description import RobotDescription
from twin.models.sensors import SENSORS, plugin_of
from twin.models.urdf.cameras import CAMERA, camera_fault, lenses
from twin.models.urdf.commands import INTERFACES, command_interface
from twin.models.urdf.document import Element, Report, first, place
from twin.models.urdf.drives import is_drive, library_of
from twin.models.urdf.gazebo import (
    MU1,
    MU2,
    NUMBERS,
    extensions_of,
    number_in,
    value_of,
)
from twin.models.urdf.sensors import PLUGIN_IMU, kind_of
from twin.models.urdf.transmissions import HARDWARE, transmissions

OWN_PLUGINS = ("joint_state_publisher", "joint-state-publisher-system", "_control", "_control-system")
"""Ends of the names of libraries whose work twin's own nodes do: joint states, and running controllers."""
WORLD_PLUGINS = ("sensors-system", "imu-system", "contact-system")
"""Of new Gazebo, which has to be told to simulate sensors at all."""


def gazebo(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield plugins, sensors, transmissions and values that have no effect, or another one than in Gazebo."""
    root, report = read_source(description)
    check = _Check(description, report)
    for element in root.findall("gazebo"):
        name = element.get("reference", "").strip()
        if name and name not in description.links and name not in description.joints:
            yield check.unknown_reference(element, name)
            continue
        for plugin in element.findall("plugin"):
            yield from check.plugin(plugin)
        for sensor in element.findall("sensor"):
            yield from check.sensor(sensor, name)
    for element in root.findall("sensor"):
        yield check.bare_sensor(element)
    for name, element in extensions_of(root):
        yield from check.values(element, name)
    for joint in root.iterfind("ros2_control/joint"):
        yield from check.interfaces(joint)
    yield from check.transmissions(root)


class _Check:
    """Makes findings about elements of one file."""

    def __init__(self, description: RobotDescription, report: Report) -> None:
        self._description = description
        self._report = report

    def unknown_reference(self, element: Element, name: str) -> Diagnostic:
        joints = element.find("sensor[@type='force_torque']") is not None
        known = self._description.joints if joints else [*self._description.links, *self._description.joints]
        hint = nearest(name, known).partition(" Valid:")[0]
        fix = f"{hint.lower()}" if hint.startswith("did") else "name an existing link or joint, or remove it"
        message = f"<gazebo> extends '{name}', which is neither a link nor a joint"
        return self._found("unknown-reference", element, message, fix)

    def plugin(self, plugin: Element) -> Iterator[Diagnostic]:
        library, name = library_of(plugin), plugin.get("name", "")
        if is_drive(plugin) or library == PLUGIN_IMU or library.endswith((*OWN_PLUGINS, *WORLD_PLUGINS)):
            return
        what = name.rpartition("::")[2] if "::" in name else (library or name)
        yield self._found(
            "not-simulated",
            plugin,
            f"plugin '{what}' is not simulated",
            "drives are DiffDrive and skid steer; give joints a <command_interface>, followers a <mimic>",
        )

    def bare_sensor(self, sensor: Element) -> Diagnostic:
        # wiki.ros.org/urdf/XML/sensor is a proposal: urdfdom can parse it, no simulator reads it.
        message = (
            f"sensor '{sensor.get('name', '')}' stands directly under <robot>, where no simulator reads it"
        )
        return self._found(
            "not-simulated", sensor, message, "put it into <gazebo reference='LINK'>, as SDF has it"
        )

    def sensor(self, sensor: Element, link: str) -> Iterator[Diagnostic]:
        kind, name = kind_of(sensor), sensor.get("name", "")
        what = f"sensor '{name}' of type {kind or 'unknown'}"
        if kind in CAMERA:
            yield from self._camera(sensor, link, what)
        elif kind not in SENSORS.names():
            message = f"{what} is not simulated"
            yield self._found(
                "not-simulated", sensor, message, f"twin has {', '.join(SENSORS.names())} and cameras"
            )
        elif (plugin := SENSORS.find(kind)).ships:
            for fault, fix in plugin.load().unlike_gazebo(sensor):
                yield self._found("not-simulated", sensor, f"{what} {fault}", fix)
        yield from self._displaced(sensor, name, link)

    def _displaced(self, sensor: Element, name: str, link: str) -> Iterator[Diagnostic]:
        for spec in self._description.sensors:
            moved = any(spec.T_link_sensor.xyz) or abs(spec.T_link_sensor.quat_wxyz[0]) < 1.0
            mine = spec.link == link and spec.name in (name, f"{link}_{name}")
            if mine and moved and plugin_of(spec).load().at_origin:
                yield self._found(
                    "not-simulated",
                    sensor,
                    f"the <pose> of sensor '{name}' holds in robot.xml; twin's own simulation samples it at "
                    f"the origin of link '{link}'",
                    "give the sensor a link of its own, fixed where it is",
                )

    def _camera(self, sensor: Element, link: str, what: str) -> Iterator[Diagnostic]:
        faults = [camera_fault(camera) for _, camera in lenses(sensor)]
        if not faults:
            yield self._found("not-simulated", sensor, f"{what} has no <camera>", "add <camera>")
        for fault in faults:
            message = (
                f"{what}: {fault}" if fault else f"{what} is a camera in robot.xml; twin renders no images"
            )
            fix = "correct it" if fault else "render them from robot.xml with MuJoCo"
            yield self._found("not-simulated", sensor, message, fix)
        if "optical" in link:
            yield self._found(
                "camera-frame",
                sensor,
                f"{what} looks along +x of '{link}', which looks by its name along +z",
                "put it on the camera's link, and name the optical frame in <optical_frame_id>",
            )

    def values(self, element: Element, name: str) -> Iterator[Diagnostic]:
        for path in NUMBERS:
            child = element.find(path)
            if child is not None and number_in(child) is None:
                yield self._found(
                    "ignored-value",
                    child,
                    f"<{child.tag}> of '{name}' is '{value_of(child)}', no number, and has no effect",
                    "write a number between the tags, or remove it",
                )
        mu1, mu2 = (number_in(first(element, *paths)) for paths in (MU1, MU2))
        if mu1 is not None and mu2 is not None and mu1 != mu2:
            yield self._found(
                "not-simulated",
                element,
                f"mu2 {mu2:g} of link '{name}': friction is the same in every direction, here mu1 {mu1:g}",
                "give both the same value",
            )

    def interfaces(self, joint: Element) -> Iterator[Diagnostic]:
        named = [interface.get("name", "") for interface in joint.findall("command_interface")]
        counts = command_interface(joint)
        if len(named) > 1 and counts is not None and counts.get("name") in INTERFACES:
            yield self._several(joint, joint.get("name", ""), named, counts.get("name"))

    def transmissions(self, root: Element) -> Iterator[Diagnostic]:
        for item in transmissions(root, self._description.joints):
            named = list(dict.fromkeys(name for name in item.interfaces if name in HARDWARE))
            title = f"transmission '{item.element.get('name', '')}'"
            if item.fault and "commands nothing" not in item.fault:
                message = f"{title} has no effect: {item.fault}"
                fix = "to command a joint that moves, give it a <command_interface> in <ros2_control>"
                yield self._found("not-simulated", item.element, message, fix, where=title)
            elif item.joint and len(named) > 1:
                yield self._several(item.element, item.joint, named, item.interface or "")

    def _several(self, element: Element, joint: str, named: list[str], counts: str) -> Diagnostic:
        message = f"joint '{joint}' has the command interfaces {', '.join(named)}; {counts} counts"
        return self._found("several-interfaces", element, message, "leave the one that is used")

    def _found(
        self, code: str, element: Element, message: str, fix: str, *, where: str | None = None
    ) -> Diagnostic:
        line = self._report.line(element)
        where = where or place(element)
        return finding(self._description, code, where, line, message=message, fix=fix)
