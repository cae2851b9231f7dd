"""`<gazebo reference='link'><sensor>` elements as data, in classic Gazebo's and new Gazebo's spelling."""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Iterator, Mapping
from dataclasses import replace
from typing import TypedDict

from twin.geometry import Pose3
from twin.models.description import Link
from twin.models.specs import ContactSpec, ImuSpec, LidarSpec, RangeSpec, SensorSpec
from twin.models.urdf.document import LARGEST, Element, Report, first, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.gazebo import value_of
from twin.models.urdf.plain_numbers import plain_numbers

LIDAR = ("gpu_lidar", "lidar", "ray", "gpu_ray")
SONAR = ("sonar", "ray-cone")
PLUGIN_IMU = "gazebo_ros_imu"
"""An IMU of ROS 1 that is a plugin of the robot, with the name of its link in <bodyName>."""
TOPICS = {"lidar": "scan", "sonar": "range", "imu": "imu", "contact": "bumper", "camera": "image_raw"}
DEFAULT_RATE_HZ = {"lidar": 10.0, "sonar": 10.0, "imu": 100.0, "contact": 50.0, "camera": 30.0}
TOPIC_TAGS = (
    "topic",
    "plugin/ros/remapping",
    "plugin/topicName",
    "plugin/bumperTopicName",
    "plugin/imageTopicName",
    "plugin/topic",
    "topicName",
)
RAY = ("lidar", "ray")
"""The element with <scan> and <range>: new and classic name."""
MAX_SAMPLES = 100_000
"""Rays of a lidar; every one of them is cast for every scan."""
MAX_RATE_HZ = 1e6


class Common(TypedDict):
    """What all sensors have."""

    name: str
    link: str
    topic: str
    rate_hz: float
    T_link_sensor: Pose3
    line: int


def read_sensors(root: Element, links: Mapping[str, Link], report: Report) -> tuple[SensorSpec, ...]:
    """Return the sensors that `twin.sim` samples, in file order; those of unknown links are left out."""
    sensors: list[SensorSpec] = []
    for link, element in sensor_elements(root, links):
        sensor = _read_sensor(element, link, report)
        if sensor is None:
            continue
        if any((sensor.name, sensor.link) == (other.name, other.link) for other in sensors):
            report.add(
                element, f"sensor '{sensor.name}' is defined twice; names are unique", code="bad-sensor"
            )
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


def _read_sensor(element: Element, link: str, report: Report) -> SensorSpec | None:
    kind = kind_of(element)
    if kind in LIDAR:
        if _is_range(element):
            return _read_range(element, link, report)
        return _read_lidar(element, link, report)
    if kind in SONAR:
        return _read_range(element, link, report)
    if kind == "imu":
        return _read_imu(element, link, report)
    if kind == "contact":
        return ContactSpec(**read_common(element, link, "contact", report))
    return None


def _is_range(element: Element) -> bool:
    """Tell whether classic Gazebo's ray sensor is read out as a sensor_msgs/Range (an ultrasonic ranger)."""
    for plugin in element.findall("plugin"):
        if text_of(plugin, "output_type") == "sensor_msgs/Range":
            return True
        if plugin.get("filename", "").endswith("gazebo_ros_range.so"):
            return True
    return False


def read_common(element: Element, link: str, kind: str, report: Report) -> Common:
    """Return what all sensors have; a rate of 0, which is every step in Gazebo, becomes the usual one."""
    rate = report.child_number(
        element, "update_rate", "plugin/updateRateHZ", "plugin/updateRate", "updateRate"
    )
    rate = rate or DEFAULT_RATE_HZ[kind]
    if not 0.0 < rate <= MAX_RATE_HZ:
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has update rate {rate:g} Hz; "
            f"it is positive and at most {MAX_RATE_HZ:g}",
            code="bad-sensor",
        )
        rate = 1.0
    topic = text_of(element, *TOPIC_TAGS) or TOPICS[kind]
    return {
        "name": report.required(element, "name"),
        "link": link,
        "topic": topic.rpartition(":=")[2].strip("/~") or TOPICS[kind],
        "rate_hz": rate,
        "T_link_sensor": read_pose(element),
        "line": report.line(element),
    }


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


def _read_lidar(element: Element, link: str, report: Report) -> LidarSpec:
    scan = _ray_child(element, "scan/horizontal")
    samples = _need(element, scan, "samples", report)
    if samples != int(samples) or not 1 <= samples <= MAX_SAMPLES:
        valid = f"a whole number from 1 to {MAX_SAMPLES}"
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has {samples:g} samples; {valid}",
            code="bad-sensor",
        )
        samples = 1.0
    angle_min, angle_max = (
        _need(element, scan, "min_angle", report),
        _need(element, scan, "max_angle", report),
    )
    if angle_min > angle_max:
        report.add(
            element, f"sensor '{element.get('name', '')}': min_angle is above max_angle", code="bad-sensor"
        )
    low, high = _read_reach(element, report)
    return LidarSpec(
        **read_common(element, link, "lidar", report),
        angle_min=angle_min,
        angle_max=angle_max,
        samples=int(samples),
        range_min=low,
        range_max=high,
        noise_stddev=_noise(element, report),
    )


def _read_range(element: Element, link: str, report: Report) -> RangeSpec:
    scan = _ray_child(element, "scan/horizontal")
    field_of_view = report.child_number(element, "plugin/fov", "sonar/fov")
    low, high = _read_reach(element, report)
    radius = report.child_number(element, "sonar/radius")
    if field_of_view is None and radius is not None and high > 0.0:
        field_of_view = 2.0 * math.atan2(radius, high)
    if field_of_view is None:
        field_of_view = _need(element, scan, "max_angle", report) - _need(element, scan, "min_angle", report)
    if not 0.0 < field_of_view < math.pi:
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has a cone of {field_of_view:g} rad; 0 to pi is valid",
            code="bad-sensor",
        )
    return RangeSpec(
        **read_common(element, link, "sonar", report),
        field_of_view=field_of_view,
        range_min=low,
        range_max=high,
        noise_stddev=_noise(element, report),
    )


def _read_imu(element: Element, link: str, report: Report) -> ImuSpec:
    both = _deviation(element, report, "plugin/gaussianNoise", "gaussianNoise") or 0.0
    gyro = _deviation(element, report, *_imu_noise("angular_velocity", "rate", "stddev"))
    bias = _deviation(element, report, *_imu_noise("angular_velocity", "rate", "bias_stddev"))
    accel = _deviation(element, report, *_imu_noise("linear_acceleration", "accel", "stddev"))
    return ImuSpec(
        **read_common(element, link, "imu", report),
        gyro_noise_stddev=both if gyro is None else gyro,
        gyro_bias_stddev=bias or 0.0,
        accel_noise_stddev=both if accel is None else accel,
    )


def _imu_noise(axes: str, classic: str, name: str) -> tuple[str, str]:
    """Return where new and classic Gazebo have a parameter of the noise."""
    return f"imu/{axes}/x/noise/{name}", f"imu/noise/{classic}/{name}"


def _read_reach(element: Element, report: Report) -> tuple[float, float]:
    reach = _ray_child(element, "range")
    if reach is None:
        reach = first(element, "sonar")
    low, high = _need(element, reach, "min", report), _need(element, reach, "max", report)
    if not 0.0 <= low < high:
        report.add(
            element,
            f"sensor '{element.get('name', '')}': range {low:g} to {high:g} m is not a range",
            code="bad-sensor",
        )
    return low, high


def _ray_child(element: Element, path: str) -> Element | None:
    return first(element, *(f"{ray}/{path}" for ray in RAY))


def _noise(element: Element, report: Report) -> float:
    paths = (*(f"{ray}/noise/stddev" for ray in RAY), "plugin/gaussianNoise")
    return _deviation(element, report, *paths) or 0.0


def _deviation(element: Element, report: Report, *paths: str) -> float | None:
    """Return a standard deviation, or None."""
    value = report.child_number(element, *paths)
    if value is not None and value < 0.0:
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has noise of {value:g}; a deviation is not negative",
            code="bad-sensor",
        )
    return value


def _need(sensor: Element, parent: Element | None, name: str, report: Report) -> float:
    value = None if parent is None else report.child_number(parent, name)
    if value is None:
        if parent is None or first(parent, name) is None:
            report.add(
                sensor,
                f"sensor '{sensor.get('name', '')}' of type {sensor.get('type')} has no <{name}>",
                code="bad-sensor",
            )
        return 1.0
    return value
