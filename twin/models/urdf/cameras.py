"""`<sensor type='camera'>` and its kin as data: SDFormat's camera element, and plugins that name topics."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Literal, TypeAlias

from twin.models.description import Link
from twin.models.specs import CameraSpec, CameraTopics, DepthNoise, Exposure
from twin.models.urdf.document import Element, Report, first, text_of
from twin.models.urdf.gazebo import number_in
from twin.models.urdf.sensors import (
    FRAME_TAGS,
    add_fault,
    kind_of,
    read_common,
    read_pose,
    sensor_elements,
    unique_name,
)
from twin.models.urdf.wide_lenses import fov_fault, read_wide_lens

_COLOUR, _DEPTH = 1, 2
_WIDE = "wideanglecamera"
_SEES: Mapping[str, int] = MappingProxyType(
    {
        "camera": _COLOUR,
        "multicamera": _COLOUR,
        _WIDE: _COLOUR,
        "depth": _COLOUR | _DEPTH,
        "depth_camera": _DEPTH,
        "rgbd": _COLOUR | _DEPTH,
        "rgbd_camera": _COLOUR | _DEPTH,
        "segmentation": 0,
        "segmentation_camera": 0,
        "boundingbox": 0,
        "boundingbox_camera": 0,
    }
)
CAMERA = tuple(_SEES)
"""Types that are cameras."""
_Truth: TypeAlias = Literal["semantic", "instance", "boxes"]
_TRUTHS: Mapping[str, tuple[str, Mapping[str, _Truth]]] = MappingProxyType(
    {
        "segmentation": (
            "segmentation_type",
            {"semantic": "semantic", "instance": "instance", "panoptic": "instance"},
        ),
        "boundingbox": ("box_type", {"visible_2d": "boxes", "2d": "boxes", "visible_box_2d": "boxes"}),
    }
)
"""By what the type begins with: the element that says which, and what its words mean; the first is usual."""
DEFAULTS: Mapping[str, float] = MappingProxyType(
    {
        "horizontal_fov": 1.047,
        "image/width": 320.0,
        "image/height": 240.0,
        "clip/near": 0.1,
        "clip/far": 100.0,
        "noise/stddev": 0.0,
        "noise/mean": 0.0,
    }
)
"""SDFormat's, for what a camera does not say."""
DISTORTION = ("k1", "k2", "p1", "p2", "k3")
"""Children of `<distortion>`, in the order of CameraInfo's D."""
ENCODINGS: Mapping[str, Literal["rgb8", "bgr8", "mono8"]] = MappingProxyType(
    {
        "R8G8B8": "rgb8",
        "RGB_INT8": "rgb8",
        "B8G8R8": "bgr8",
        "BGR_INT8": "bgr8",
        "L8": "mono8",
        "L_INT8": "mono8",
    }
)
"""By the name of `<format>`; what is not here becomes `rgb8`."""
MAX_PIXELS = 8192
"""Of an image, each way: what OpenGL without a graphics card draws everywhere."""
_WIDEST = math.pi - 1e-3


def read_cameras(
    root: Element, links: Mapping[str, Link], report: Report, *, taken: Collection[str]
) -> tuple[CameraSpec, ...]:
    """Return the cameras in file order; those with an impossible field of view are left out.

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
            spec = _read(element, camera, link, report)
            names = [*taken, *(other.name for other in cameras)]
            own = unique_name(name or spec.name, link, names)
            topics = _topics(element, own)
            if spec.truth is not None:
                topic = topics.boxes if spec.truth == "boxes" else topics.labels_map
            else:
                topic = topics.image if spec.colour else topics.depth
            cameras.append(replace(spec, name=own, topic=topic, topics=topics))
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
    """Return why a `<camera>` of a sensor is none; empty if it is one."""
    fov, sensor = _number(camera, "horizontal_fov"), camera.getparent()
    if sensor is not None and kind_of(sensor) == _WIDE:
        return fov_fault(camera, fov)
    if not 0.0 < fov < _WIDEST:
        return f"horizontal_fov {fov:g} rad; a pinhole camera has less than pi"
    return ""


def _read(sensor: Element, camera: Element, link: str, report: Report) -> CameraSpec:
    """Return a camera; its name and topics are yet to be settled."""
    common = read_common(sensor, link, report, topic="image_raw", rate_hz=30.0)
    common["T_link_sensor"] = common["T_link_sensor"] @ read_pose(camera)
    fov, width, height, near, far, noise, mean = (_number(camera, path) for path in DEFAULTS)
    width, height = _size(sensor, width, height, report)
    own = first(camera, "depth_camera/clip")
    if own is not None:
        near = _number_at(own, "near", near)
        far = _number_at(own, "far", far)
    if not 0.0 < near < far:
        add_fault(report, sensor, f" sees from {near:g} to {far:g} m; valid is 0 < near < far")
    if noise < 0.0:
        add_fault(report, sensor, f" has noise of {noise:g}; a deviation is not negative")
    sees, format_ = _SEES[kind_of(sensor)], text_of(camera, "image/format") or ""
    coarse = text_of(camera, "depth_camera/format") or (format_ if not sees & _COLOUR else "")
    size = int(width), int(height)
    return CameraSpec(
        **common,
        horizontal_fov=fov,
        width=size[0],
        height=size[1],
        near=near,
        far=far,
        noise_stddev=noise,
        noise_mean=mean,
        optical_frame=text_of(sensor, "camera/optical_frame_id", *FRAME_TAGS),
        colour=bool(sees & _COLOUR),
        depth=bool(sees & _DEPTH),
        truth=None if sees else _truth(sensor, camera, report),
        encoding=ENCODINGS.get(format_.upper(), "rgb8"),
        depth_encoding="16UC1" if coarse.upper() in ("16UC1", "L16", "L_INT16", "R_UINT16") else "32FC1",
        depth_noise=_depth_noise(sensor, camera, report),
        distortion=tuple(_number_at(camera, f"distortion/{name}", 0.0) for name in DISTORTION),  # type: ignore[arg-type]
        exposure=_exposure(sensor, camera, report),
        wide=read_wide_lens(sensor, camera, size, fov, report) if kind_of(sensor) == _WIDE else None,
    )


def _size(sensor: Element, width: float, height: float, report: Report) -> tuple[float, float]:
    for size in (width, height):
        if size != int(size) or not 1 <= size <= MAX_PIXELS:
            valid = f"whole numbers from 1 to {MAX_PIXELS}"
            add_fault(report, sensor, f" has an image of {width:g} x {height:g} pixels; valid are {valid}")
            return 1.0, 1.0
    return width, height


def _truth(sensor: Element, camera: Element, report: Report) -> _Truth:
    """Return what a camera of labels or boxes tells."""
    tag, meanings = _TRUTHS[kind_of(sensor).removesuffix("_camera")]
    said = text_of(camera, tag) or next(iter(meanings))
    if said not in meanings:
        add_fault(report, sensor, f" has a <{tag}> of '{said}'; valid are {', '.join(meanings)}")
    return meanings.get(said, next(iter(meanings.values())))


def _depth_noise(sensor: Element, camera: Element, report: Report) -> DepthNoise | None:
    """Return the noise of `<depth_camera><noise>`, an element of ours."""
    noise = camera.find("depth_camera/noise")
    model = "" if noise is None else text_of(noise, "type") or noise.get("type") or ""
    if noise is None or model == "none":
        return None
    if model not in ("realsense", "kinect"):
        add_fault(report, sensor, f" has depth noise of type '{model}'; valid are none, realsense and kinect")
        return None
    values = {name: _number_at(noise, name, getattr(DepthNoise, name)) for name in ("baseline", "subpixel")}
    if min(values.values()) <= 0.0:
        add_fault(report, sensor, " has depth noise whose baseline and subpixel are not both positive")
        return None
    return DepthNoise(model=model, **values)  # type: ignore[arg-type]


def _exposure(sensor: Element, camera: Element, report: Report) -> Exposure | None:
    """Return what `<exposure>` says, an element of ours."""
    found = camera.find("exposure")
    kind = "none" if found is None else text_of(found, "type") or found.get("type") or "fixed"
    if found is None or kind == "none":
        return None
    if kind not in ("fixed", "auto"):
        add_fault(report, sensor, f" has an exposure of type '{kind}'; valid are none, fixed and auto")
        return None
    usual = Exposure(target=0.45 if kind == "auto" else None)
    names = [field.name for field in fields(Exposure) if getattr(usual, field.name) is not None]
    values = {name: _number_at(found, name, getattr(usual, name)) for name in names}
    positive = min(values[name] for name in ("gain", "min_gain", "full_well")) > 0.0
    if not (positive and values["min_gain"] <= values["max_gain"] and 0.0 < values.get("target", 0.5) < 1.0):
        valid = "gain and full_well > 0, 0 < min_gain <= max_gain, 0 < target < 1"
        add_fault(report, sensor, f" has an exposure that cannot be; valid are {valid}")
        return None
    if min(values["lag"], values["read_noise"]) < 0.0:
        add_fault(report, sensor, " has an exposure whose lag or read_noise is negative")
        return None
    return Exposure(**values)


def _topics(sensor: Element, name: str) -> CameraTopics:
    """Return the topics, below the camera's name unless the file says otherwise.

    `<topic>` of new Gazebo is that of the images, or for a camera of colours and depth what all are below.
    """
    base = _relative(text_of(sensor, "plugin/camera_name", "plugin/cameraName")) or name
    space = _relative(text_of(sensor, "plugin/ros/namespace"))
    if space:
        base = f"{space}/{base}"
    given = _relative(text_of(sensor, "topic"))
    sees = _SEES[kind_of(sensor)]
    if given and not sees:
        topics = replace(CameraTopics.below(given), **CameraTopics.of_truth(given))
        if kind_of(sensor).startswith("boundingbox"):
            topics = replace(topics, boxes=given)
    elif given and sees == _COLOUR | _DEPTH:
        topics = CameraTopics.below(given)
    elif given:
        above = given.rpartition("/")[0]
        info = f"{above}/camera_info".lstrip("/")
        topics = replace(CameraTopics.below(above or name), image=given, info=info)
        if sees == _DEPTH:
            topics = replace(topics, depth=given, depth_info=info, points=f"{given}/points")
    else:
        topics = CameraTopics.below(base)
    return replace(topics, **_renamed(sensor, base))


_PARTS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "image": ("imageTopicName",),
        "info": ("cameraInfoTopicName",),
        "depth": ("depthImageTopicName",),
        "depth_info": ("depthImageCameraInfoTopicName", "depthImageInfoTopicName"),
        "points": ("pointCloudTopicName",),
    }
)
"""Tags of ROS 1's plugins that name a topic below <cameraName>, or wholly with a slash before it."""
_REMAPPED = {
    "image_raw": "image",
    "camera_info": "info",
    "depth/image_raw": "depth",
    "depth/camera_info": "depth_info",
    "points": "points",
}
"""What ROS 2's plugin calls its topics before they are remapped."""


def _renamed(sensor: Element, base: str) -> dict[str, str]:
    """Return the topics that a plugin names, by the field of `CameraTopics`."""
    named = {}
    for part, tags in _PARTS.items():
        text = text_of(sensor, *(f"plugin/{tag}" for tag in tags))
        if text:
            below = sensor.find("plugin/cameraName") is not None and not text.startswith("/")
            named[part] = f"{base}/{_relative(text)}" if below else _relative(text)
    for rule in sensor.iterfind("plugin/ros/remapping"):
        before, _, after = (rule.text or "").strip().partition(":=")
        plain = _relative(before).removeprefix(f"{base.rpartition('/')[2]}/")
        if plain in _REMAPPED and _relative(after):
            named[_REMAPPED[plain]] = _relative(after)
    return named


def _relative(name: str | None) -> str:
    return (name or "").strip("/~ ")


def _number(camera: Element, path: str) -> float:
    return _number_at(camera, path, DEFAULTS[path])


def _number_at(element: Element, path: str, default: float) -> float:
    value = number_in(element.find(path))
    return default if value is None else value
