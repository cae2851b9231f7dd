"""What lidars and sonars share: `<ray>` or `<lidar>` in a `<sensor>`, and MuJoCo's rangefinders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import MappingProxyType
from typing import TypeVar

import mujoco

from twin.convert.ledger.fates import NOISE, Fate
from twin.convert.sensors import SensorBuilder
from twin.geometry import Array, multiply_wxyz
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report, first
from twin.models.urdf.sensors import add_fault, deviation, required_number

M = TypeVar("M", bound=str)

RAY = ("lidar", "ray", "plugin/ray")
"""The element with <scan> and <range>: new and classic name, and that of Livox's plugin."""
RAY_ALONG_X = (0.5**0.5, 0.0, 0.5**0.5, 0.0)
"""A rangefinder looks along its site's z axis; this turns it to the sensor's x axis."""
MAX_RAYS = 2048
"""A planar lidar with more rays than this is left out: MuJoCo casts every ray anew in every step."""
MAX_RAYS_OF_ALL = 4 * MAX_RAYS
"""Further lidars and sonars are left out likewise."""
RAYS: Fate = ("translated", "one site and rangefinder per ray")
RANGE: Fate = ("translated", "cutoff of the rangefinders")
ELSEWHERE: Fate = ("dropped", "not in robot.xml; report.json has it")
FATES = MappingProxyType(
    {
        "scan/horizontal/samples": RAYS,
        "scan/horizontal/min_angle": RAYS,
        "scan/horizontal/max_angle": RAYS,
        "range/max": RANGE,
        "range/min": ELSEWHERE,
        "sonar/max": RANGE,
        "sonar/min": ELSEWHERE,
        "sonar/radius": RAYS,
        "plugin/fov": RAYS,
        "method": ELSEWHERE,
        "noise/stddev": NOISE,
        "plugin/gaussianNoise": NOISE,
    }
)


def ray_child(element: Element, path: str) -> Element | None:
    """Return an element below `<ray>` or `<lidar>`."""
    return first(element, *(f"{ray}/{path}" for ray in RAY))


def read_reach(element: Element, report: Report) -> tuple[float, float]:
    """Return the shortest and the longest range [m]."""
    reach = ray_child(element, "range")
    if reach is None:
        reach = first(element, "sonar")
    low = required_number(element, reach, "min", report)
    high = required_number(element, reach, "max", report)
    if not 0.0 <= low < high:
        add_fault(report, element, f": range {low:g} to {high:g} m is not a range")
    return low, high


def read_noise(element: Element, report: Report) -> float:
    """Return the standard deviation of a range [m]."""
    paths = (*(f"{ray}/noise/stddev" for ray in RAY), "plugin/gaussianNoise")
    return deviation(element, report, *paths) or 0.0


def read_method(element: Element, report: Report, usual: M, *others: M) -> M:
    """Return how a lidar measures, `<method>` in `<ray>`: an element of ours, which Gazebo ignores."""
    found = ray_child(element, "method")
    if found is None:
        return usual
    text, valid = (found.text or "").strip(), (usual, *others)
    for method in valid:
        if text == method:
            return method
    add_fault(
        report, element, f" has <method>{text}</method>; valid is {', '.join(valid[:-1])} or {valid[-1]}"
    )
    return usual


def add_rangefinders(
    model: SensorBuilder, spec: SensorSpec, turns: Sequence[Array], *, cutoff: float, noise: float
) -> Iterator[str]:
    """Add a rangefinder per ray; `turns` are from the sensor's x axis to each ray's, as quat_wxyz."""
    if model.count(mujoco.mjtSensor.mjSENS_RANGEFINDER) + len(turns) > MAX_RAYS_OF_ALL:
        return
    digits = max(3, len(str(len(turns) - 1)))
    for index, turn in enumerate(turns):
        name = f"{spec.name}-{index:0{digits}}"
        yield model.sensor(
            name,
            mujoco.mjtSensor.mjSENS_RANGEFINDER,
            mujoco.mjtObj.mjOBJ_SITE,
            model.site(spec, name, multiply_wxyz(turn, RAY_ALONG_X)),
            intprm=[1 << int(mujoco.mjtRayDataField.mjRAYDATA_DIST), 0, 0],
            cutoff=cutoff,
            noise=noise,
        )
