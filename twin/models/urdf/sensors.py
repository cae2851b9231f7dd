"""`<gazebo reference='link'><sensor>` elements as data, in classic Gazebo's and new Gazebo's spelling."""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypedDict

from twin.geometry import Pose3
from twin.models.description import Link
from twin.models.options import ReadOptions
from twin.models.sensors import SENSORS
from twin.models.specs import SensorSpec
from twin.models.urdf.document import LARGEST, Element, Report, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.gazebo import value_of
from twin.models.urdf.plain_numbers import plain_numbers
from twin.plugins import Plugin

PLUGIN_IMU = "gazebo_ros_imu"
"""An IMU of ROS 1 that is a plugin of the robot, with the name of its link in <bodyName>."""
TOPIC_TAGS = (
    "topic",
    "plugin/ros/remapping",
    "plugin/topicName",
    "plugin/bumperTopicName",
    "plugin/imageTopicName",
    "plugin/topic",
    "plugin/ros_topic",
    "topicName",
)
RATE_TAGS = ("update_rate", "plugin/updateRateHZ", "plugin/updateRate", "updateRate")
FRAME_TAGS = ("gz_frame_id", "ignition_frame_id", "plugin/frame_name", "plugin/frameName")
MAX_RATE_HZ = 1e6


class Common(TypedDict):
    """What all sensors have."""

    name: str
    link: str
    topic: str
    rate_hz: float
    T_link_sensor: Pose3
    line: int


def read_sensors(
    root: Element, links: Mapping[str, Link], report: Report, options: ReadOptions
) -> tuple[SensorSpec, ...]:
    """Return the sensors that `twin.sim` samples, in file order; those of unknown links are left out."""
    sensors: list[SensorSpec] = []
    for link, element in sensor_elements(root, links):
        plugin = _plugin_for(element, options)
        if plugin is None:
            continue
        for sensor in _read_sensor(element, link, report, plugin):
            if any((sensor.name, sensor.link) == (other.name, other.link) for other in sensors):
                message = f"sensor '{sensor.name}' is defined twice; names are unique"
                report.add(element, message, code="bad-sensor")
            name = unique_name(sensor.name, link, [other.name for other in sensors])
            sensors.append(replace(sensor, name=name))
    return tuple(sensors)


def sensor_elements(root: Element, links: Container[str]) -> Iterator[tuple[str, Element]]:
    """Yield the sensors of known links with their link: `<sensor>`s, and IMUs that are but a plugin."""
    for gazebo in root.findall("gazebo"):
        link = gazebo.get("reference", "").strip()
        for element in gazebo:
            if element.tag == "sensor" and link in links:
                yield link, element
            elif element.tag == "plugin" and library_of(element) == PLUGIN_IMU:
                body = text_of(element, "bodyName") or ""
                if body in links:
                    yield body, element


def unique_name(name: str, link: str, taken: Collection[str]) -> str:
    """Return a sensor's name, with its link's if it is taken: Gazebo's are unique within a link only."""
    return f"{link}_{name}" if name in taken else name


def kind_of(element: Element) -> str:
    """Return the type of a sensor or sensor plugin as Gazebo spells it."""
    return "imu" if element.tag == "plugin" else str(element.get("type", "")).strip()


def _plugin_for(element: Element, options: ReadOptions) -> Plugin[Any] | None:
    """Return what reads a sensor; None: it is not simulated, or is a package's, which may not be run."""
    kind = kind_of(element)
    for plugin in options.sensors:
        types = plugin.load().types
        if not isinstance(types, tuple) or not types:
            raise plugin.error("names no `types`, the type='...' of the <sensor>s that it is")
        if kind in types:
            return plugin
    if kind not in SENSORS.names():
        return None
    plugin = SENSORS.find(kind)
    return plugin if plugin.ships or options.execute else None


def _read_sensor(element: Element, link: str, report: Report, plugin: Plugin[Any]) -> list[SensorSpec]:
    """Return what a `<sensor>` is: one sensor, or several that look through the same glass."""
    with plugin.guard:
        sensor = plugin.load().for_element(element)
        common = read_common(element, link, report, topic=sensor.topic, rate_hz=sensor.rate_hz)
        spec: SensorSpec = sensor.read(element, common, report)
        specs = [spec, *sensor.companions(element, spec, report)]
    for each in specs:
        if not isinstance(each, SensorSpec):
            raise plugin.error(f"reads a {type(each).__name__} from its <sensor>; it must be a SensorSpec")
    return specs if plugin.ships else [replace(each, plugin=plugin) for each in specs]


def read_common(element: Element, link: str, report: Report, *, topic: str, rate_hz: float) -> Common:
    """Return what all sensors have; a rate of 0, which is every step in Gazebo, becomes the usual one."""
    rate = report.child_number(element, *RATE_TAGS) or rate_hz
    if not 0.0 < rate <= MAX_RATE_HZ:
        valid = f"it is positive and at most {MAX_RATE_HZ:g}"
        add_fault(report, element, f" has update rate {rate:g} Hz; {valid}")
        rate = 1.0
    given = text_of(element, *TOPIC_TAGS) or topic
    return {
        "name": report.required(element, "name"),
        "link": link,
        "topic": given.rpartition(":=")[2].strip("/~") or topic,
        "rate_hz": rate,
        "T_link_sensor": read_pose(element),
        "line": report.line(element),
    }


def add_fault(report: Report, element: Element, fault: str) -> None:
    """Note what is wrong with a sensor; `fault` goes on after its name."""
    report.add(element, f"sensor '{element.get('name', '')}'{fault}", code="bad-sensor")


def read_pose(element: Element) -> Pose3:
    """Return an SDFormat `<pose>` in its parent's frame, the identity if there is none that can be read."""
    pose = element.find("pose")
    try:
        x, y, z, *rpy = plain_numbers(value_of(pose))
        roll, pitch, yaw = rpy
    except ValueError:
        return Pose3.from_xyz_rpy()
    if pose is not None and pose.get("degrees") in ("true", "1"):
        roll, pitch, yaw = (math.radians(angle) for angle in (roll, pitch, yaw))
    if not all(abs(value) <= LARGEST for value in (x, y, z, roll, pitch, yaw)):
        return Pose3.from_xyz_rpy()
    return Pose3.from_xyz_rpy((x, y, z), (roll, pitch, yaw))


def deviation(element: Element, report: Report, *paths: str) -> float | None:
    """Return a standard deviation, or None."""
    value = report.child_number(element, *paths)
    if value is not None and value < 0.0:
        add_fault(report, element, f" has noise of {value:g}; a deviation is not negative")
    return value


def required_number(sensor: Element, parent: Element | None, name: str, report: Report) -> float:
    """Return the number of a child that a sensor cannot do without."""
    value = None if parent is None else report.child_number(parent, name)
    if value is None:
        if parent is None or parent.find(name) is None:
            add_fault(report, sensor, f" of type {sensor.get('type')} has no <{name}>")
        return 1.0
    return value
