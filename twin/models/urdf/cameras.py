"""`<sensor type='camera'>` and its kin as data (SDFormat's camera element; classic and new Gazebo)."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping

from twin.models.description import Link
from twin.models.specs import CameraSpec
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.gazebo import number_in
from twin.models.urdf.sensors import kind_of, read_common, read_pose, sensor_elements, unique_name

CAMERA = ("camera", "depth", "depth_camera", "rgbd", "rgbd_camera", "multicamera")
"""Types whose image a pinhole camera makes."""
FRAME_TAGS = (
    *("camera/optical_frame_id", "gz_frame_id", "ignition_frame_id"),
    *("plugin/frame_name", "plugin/frameName"),
)
DEFAULTS: Mapping[str, float] = {
    "horizontal_fov": 1.047,
    "image/width": 320.0,
    "image/height": 240.0,
    "clip/near": 0.1,
    "clip/far": 100.0,
    "noise/stddev": 0.0,
}
"""SDFormat's, for what a camera does not say."""


def read_cameras(
    root: Element, links: Mapping[str, Link], report: Report, *, taken: Collection[str]
) -> tuple[CameraSpec, ...]:
    """Return the cameras in file order; those that no pinhole camera can be are left out.

    Args:
        root: The `<robot>`.
        links: By name.
        report: Where problems go.
        taken: Names of other sensors.
    """
    cameras: list[CameraSpec] = []
    for link, element in sensor_elements(root, links):
        for name, camera in lenses(element):
            if camera_fault(camera):
                continue
            common = read_common(element, link, report, topic="image_raw", rate_hz=30.0)
            names = [*taken, *(other.name for other in cameras)]
            common["name"] = unique_name(name or common["name"], link, names)
            common["T_link_sensor"] = common["T_link_sensor"] @ read_pose(camera)
            fov, width, height, near, far, noise = (_number(camera, path) for path in DEFAULTS)
            spec = CameraSpec(
                **common,
                horizontal_fov=fov,
                width=int(width),
                height=int(height),
                near=near,
                far=far,
                noise_stddev=noise,
                optical_frame=text_of(element, *FRAME_TAGS),
            )
            cameras.append(spec)
    return tuple(cameras)


def lenses(sensor: Element) -> Iterator[tuple[str, Element]]:
    """Yield each `<camera>` of a camera sensor (a multicamera has several) with the name that it gets."""
    if kind_of(sensor) not in CAMERA:
        return
    found = sensor.findall("camera")
    several = len(found) > 1
    for number, camera in enumerate(found):
        own = camera.get("name") or str(number)
        yield f"{sensor.get('name', '')}_{own}" if several else str(sensor.get("name", "")), camera


def camera_fault(camera: Element) -> str:
    """Return why a `<camera>` is no pinhole camera; empty if it is one."""
    fov = _number(camera, "horizontal_fov")
    if not 0.0 < fov < math.pi - 1e-3:
        return f"horizontal_fov {fov:g} rad; a pinhole camera has less than pi"
    width, height = _number(camera, "image/width"), _number(camera, "image/height")
    if min(width, height) < 1.0 or max(width, height) > 2**15:
        return f"an image of {width:g} x {height:g} pixels"
    return ""


def _number(camera: Element, path: str) -> float:
    value = number_in(camera.find(path))
    return DEFAULTS[path] if value is None else value
