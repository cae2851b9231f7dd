"""What became of `<sensor>`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from twin.convert.ledger.fates import Fate, container_fate
from twin.convert.sensors import MAX_RAYS
from twin.models.description import RobotDescription
from twin.models.specs import CameraSpec, LidarSpec, SensorSpec
from twin.models.urdf.cameras import CAMERA
from twin.models.urdf.document import Element
from twin.models.urdf.gazebo import value_of
from twin.models.urdf.sensors import kind_of

RAYS: Fate = ("translated", "one site and rangefinder per ray")
RANGE: Fate = ("translated", "cutoff of the rangefinders")
NOISE: Fate = ("translated", "noise of the sensor; MuJoCo itself adds none")
ELSEWHERE = "not in robot.xml; report.json has it"
OUTPUT: Fate = ("dropped", "the plugin is not simulated")
TAGS: Mapping[str, Fate] = MappingProxyType(
    {
        "scan/horizontal/samples": RAYS,
        "scan/horizontal/min_angle": RAYS,
        "scan/horizontal/max_angle": RAYS,
        "range/max": RANGE,
        "sonar/max": RANGE,
        "sonar/radius": RAYS,
        "plugin/fov": RAYS,
        "noise/stddev": NOISE,
        "angular_velocity/x/noise/stddev": NOISE,
        "linear_acceleration/x/noise/stddev": NOISE,
        "noise/rate/stddev": NOISE,
        "noise/accel/stddev": NOISE,
        "gaussianNoise": NOISE,
        "plugin/gaussianNoise": NOISE,
        "bodyName": ("translated", "body of the site"),
        "pose": ("kept", "pose of the site"),
        "horizontal_fov": ("translated", "fovy, by the image's shape"),
        "image/width": ("kept", "resolution"),
        "image/height": ("kept", "resolution"),
        "topic": ("dropped", ELSEWHERE),
        "update_rate": ("dropped", f"MuJoCo measures in every step; {ELSEWHERE}"),
        "range/min": ("dropped", ELSEWHERE),
        "sonar/min": ("dropped", ELSEWHERE),
        "clip/near": ("dropped", f"MuJoCo clips all cameras alike; {ELSEWHERE}"),
        "clip/far": ("dropped", f"MuJoCo clips all cameras alike; {ELSEWHERE}"),
        "always_on": ("dropped", "sensors are always on"),
        "collision": ("dropped", "every shape of the link counts"),
    }
)
"""By path below the sensor, without `ray`, `lidar`, `imu`, `camera` and `contact`."""
WRAPPERS = ("ray", "lidar", "imu", "camera", "contact")


def sensor_fate(element: Element, sensor: Element, link: str, description: RobotDescription) -> Fate:
    """Return the fate of an element of a `<sensor>` on a link or joint, or of that itself."""
    spec = _spec_of(sensor, link, description)
    if spec is None:
        kind = kind_of(sensor) or "without a type"
        return "dropped", f"not simulated: a sensor of type {kind}"
    if isinstance(spec, LidarSpec) and spec.samples > MAX_RAYS:
        return "dropped", f"{spec.samples} rays; more than {MAX_RAYS} are left out. {ELSEWHERE}"
    if element is sensor:
        return "translated", _translation(spec)
    path = _path(element, sensor)
    if len(element) and path not in TAGS:
        return container_fate(element, lambda child: sensor_fate(child, sensor, link, description))
    if isinstance(spec, CameraSpec) and path.startswith("noise"):
        return "dropped", f"MuJoCo's images are free of noise; {ELSEWHERE}"
    if path.endswith("bias_stddev"):
        return "dropped", ELSEWHERE
    if path.startswith(("angular_velocity/", "linear_acceleration/")) and path.endswith("/stddev"):
        return _axis_noise(element, path, sensor)
    if path in TAGS:
        return TAGS[path]
    return OUTPUT if path.startswith("plugin") else ("dropped", "no counterpart in MuJoCo")


def _spec_of(sensor: Element, link: str, description: RobotDescription) -> SensorSpec | None:
    if sensor.tag == "plugin":
        link = value_of(sensor.find("bodyName"))
    name = sensor.get("name", "")
    for spec in (*description.sensors, *description.cameras):
        lens = isinstance(spec, CameraSpec) and kind_of(sensor) in CAMERA
        if spec.link == link and (
            spec.name in (name, f"{link}_{name}") or (lens and spec.name.startswith(f"{name}_"))
        ):
            return spec
    return None


def _path(element: Element, sensor: Element) -> str:
    tags = []
    while element is not sensor:
        if element.tag not in WRAPPERS or len(element) == 0:
            tags.append(element.tag)
        element = element.getparent()
    return "/".join(reversed(tags))


def _translation(spec: SensorSpec) -> str:
    kinds = {
        "LidarSpec": "a site and rangefinder per ray",
        "RangeSpec": "a site and rangefinder per ray of the cone",
        "ImuSpec": "site with framequat, gyro and accelerometer",
        "ContactSpec": "contact sensor of the body",
        "CameraSpec": "camera",
    }
    return f"{kinds[type(spec).__name__]}, called '{spec.name}'"


def _axis_noise(element: Element, path: str, sensor: Element) -> Fate:
    """Return the fate of an IMU's noise about one axis: that of x holds for all."""
    quantity, axis = path.split("/")[:2]
    x = sensor.find(f"imu/{quantity}/x/noise/{element.tag}")
    if axis == "x" or (x is not None and value_of(x) == value_of(element)):
        return NOISE
    return "dropped", "the noise of the x axis holds for all axes"
