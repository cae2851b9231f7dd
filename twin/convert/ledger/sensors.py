"""What became of `<sensor>`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from twin.convert.ledger.fates import Fate, container_fate
from twin.models.description import RobotDescription
from twin.models.sensors import SENSORS, plugin_of
from twin.models.specs import CameraSpec, SensorSpec
from twin.models.urdf.document import Element
from twin.models.urdf.gazebo import value_of
from twin.models.urdf.sensors import CAMERA, kind_of

ELSEWHERE = "not in robot.xml; report.json has it"
TAGS: Mapping[str, Fate] = MappingProxyType(
    {
        "bodyName": ("translated", "body of the site"),
        "pose": ("kept", "pose of the site"),
        "topic": ("dropped", ELSEWHERE),
        "update_rate": ("dropped", f"MuJoCo measures in every step; {ELSEWHERE}"),
        "always_on": ("dropped", "sensors are always on"),
        "collision": ("dropped", "every shape of the link counts"),
    }
)
"""By path below the sensor, without `ray`, `lidar`, `imu`, `camera` and `contact`."""
OF_CAMERAS: Mapping[str, Fate] = MappingProxyType(
    {
        "horizontal_fov": ("translated", "fovy, by the image's shape"),
        "image/width": ("kept", "resolution"),
        "image/height": ("kept", "resolution"),
        "clip/near": ("dropped", f"MuJoCo clips all cameras alike; {ELSEWHERE}"),
        "clip/far": ("dropped", f"MuJoCo clips all cameras alike; {ELSEWHERE}"),
    }
)
WRAPPERS = ("ray", "lidar", "imu", "camera", "contact")


def sensor_fate(element: Element, sensor: Element, link: str, description: RobotDescription) -> Fate:
    """Return the fate of an element of a `<sensor>` on a link or joint, or of that itself."""
    spec = _spec_of(sensor, link, description)
    if spec is None:
        kind = kind_of(sensor) or "without a type"
        left_out = (
            "left out: only runs execute a package's sensor" if kind in SENSORS.names() else "not simulated"
        )
        return "dropped", f"{left_out}: a sensor of type {kind}"
    camera = isinstance(spec, CameraSpec)
    cls = None if camera else plugin_of(spec).load()
    missing = cls.left_out(spec) if cls is not None else ""
    if missing:
        return "dropped", f"{missing}. {ELSEWHERE}"
    if element is sensor:
        return "translated", f"{'camera' if cls is None else cls.in_mujoco}, called '{spec.name}'"
    path = _path(element, sensor)
    own = OF_CAMERAS.get(path) if cls is None else cls.fate(path, element, sensor)
    if own is None and len(element) and path not in TAGS:
        return container_fate(element, lambda child: sensor_fate(child, sensor, link, description))
    if camera and path.startswith("noise"):
        return "dropped", f"MuJoCo's images are free of noise; {ELSEWHERE}"
    plugin = path.startswith("plugin")
    why = "the plugin is not simulated" if plugin else "no counterpart in MuJoCo"
    return own or TAGS.get(path) or ("dropped", why)


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
