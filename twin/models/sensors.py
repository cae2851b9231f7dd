"""`<gazebo reference='link'><sensor>` elements as data, in classic Gazebo's and new Gazebo's spelling."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypedDict

from twin.errors import nearest
from twin.models.description import ContactSpec, ImuSpec, LidarSpec, Link, RangeSpec, SensorSpec
from twin.models.document import Element, Report, first, text_of

LIDAR = ("gpu_lidar", "lidar", "ray", "gpu_ray")
SONAR = ("sonar", "ray-cone")
TOPICS = {"lidar": "scan", "sonar": "range", "imu": "imu", "contact": "bumper"}
DEFAULT_RATE_HZ = {"lidar": 10.0, "sonar": 10.0, "imu": 100.0, "contact": 50.0}
RAY = ("lidar", "ray")
"""The element with <scan> and <range>: new and classic name."""


class _Common(TypedDict):
    name: str
    link: str
    topic: str
    rate_hz: float
    line: int


def read_sensors(root: Element, links: Mapping[str, Link], report: Report) -> tuple[SensorSpec, ...]:
    """Return the sensors in file order; types that twin does not simulate (cameras) are left out."""
    sensors: list[SensorSpec] = []
    for gazebo in root.findall("gazebo"):
        for element in gazebo.findall("sensor"):
            link = gazebo.get("reference", "")
            if link not in links:
                missing = f"sensor '{element.get('name', '')}' is on link '{link}', which does not exist"
                report.add(gazebo, f"{missing}; {nearest(link, links)}", code="bad-sensor")
                continue
            sensor = _read_sensor(element, link, report)
            if sensor is None:
                continue
            if any(sensor.name == other.name for other in sensors):
                report.add(
                    element, f"sensor '{sensor.name}' is defined twice; names are unique", code="bad-sensor"
                )
            sensors.append(sensor)
    return tuple(sensors)


def _read_sensor(element: Element, link: str, report: Report) -> SensorSpec | None:
    kind = element.get("type", "")
    if kind in LIDAR:
        if _is_range(element):
            return _read_range(element, link, report)
        return _read_lidar(element, link, report)
    if kind in SONAR:
        return _read_range(element, link, report)
    if kind == "imu":
        return _read_imu(element, link, report)
    if kind == "contact":
        return ContactSpec(**_common(element, link, "contact", report))
    return None


def _is_range(element: Element) -> bool:
    """Tell whether classic Gazebo's ray sensor is read out as a sensor_msgs/Range (an ultrasonic ranger)."""
    for plugin in element.findall("plugin"):
        if text_of(plugin, "output_type") == "sensor_msgs/Range":
            return True
        if plugin.get("filename", "").endswith("gazebo_ros_range.so"):
            return True
    return False


def _common(element: Element, link: str, kind: str, report: Report) -> _Common:
    rate = report.child_number(element, "update_rate", "plugin/updateRateHZ", "plugin/updateRate")
    rate = DEFAULT_RATE_HZ[kind] if rate is None else rate
    if rate <= 0.0:
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has update rate {rate:g} Hz; it is positive",
            code="bad-sensor",
        )
        rate = 1.0
    topic = (
        text_of(element, "topic", "plugin/ros/remapping", "plugin/topicName", "plugin/topic") or TOPICS[kind]
    )
    return {
        "name": report.required(element, "name"),
        "link": text_of(element, "gz_frame_id", "ignition_frame_id", "plugin/frame_name", "plugin/frameName")
        or link,
        "topic": topic.rpartition(":=")[2].strip("/~"),
        "rate_hz": rate,
        "line": report.line(element),
    }


def _read_lidar(element: Element, link: str, report: Report) -> LidarSpec:
    scan = _ray_child(element, "scan/horizontal")
    samples = _need(element, scan, "samples", report)
    if samples != int(samples) or samples < 1:
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has {samples:g} samples; a whole number from 1",
            code="bad-sensor",
        )
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
        **_common(element, link, "lidar", report),
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
    if field_of_view is None:
        field_of_view = _need(element, scan, "max_angle", report) - _need(element, scan, "min_angle", report)
    if not 0.0 < field_of_view < math.pi:
        report.add(
            element,
            f"sensor '{element.get('name', '')}' has a cone of {field_of_view:g} rad; 0 to pi is valid",
            code="bad-sensor",
        )
    low, high = _read_reach(element, report)
    return RangeSpec(
        **_common(element, link, "sonar", report),
        field_of_view=field_of_view,
        range_min=low,
        range_max=high,
        noise_stddev=_noise(element, report),
    )


def _read_imu(element: Element, link: str, report: Report) -> ImuSpec:
    gyro, accel = "imu/angular_velocity/x/noise", "imu/linear_acceleration/x/noise"
    return ImuSpec(
        **_common(element, link, "imu", report),
        gyro_noise_stddev=report.child_number(element, f"{gyro}/stddev") or 0.0,
        gyro_bias_stddev=report.child_number(element, f"{gyro}/bias_stddev") or 0.0,
        accel_noise_stddev=report.child_number(element, f"{accel}/stddev") or 0.0,
    )


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
    return report.child_number(element, *(f"{ray}/noise/stddev" for ray in RAY)) or 0.0


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
