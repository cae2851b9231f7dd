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
    """Return the cameras in file order; those that cannot be are left out, with a warning.

    Args:
        root: The `<robot>`.
        links: By name.
        report: Where problems go.
        taken: Names of other sensors.
    """
    cameras: list[CameraSpec] = []
    for link, element in sensor_elements(root, links):
        for name, camera in lenses(element):
            fault = _fault(camera)
            if fault:
                what = f"sensor '{element.get('name', '')}' of type {kind_of(element)}"
                report.warn(element, f"{what} is left out: {fault}", code="not-simulated")
                continue
            spec = _read(element, camera, link, report)
            names = [*taken, *(other.name for other in cameras)]
            own = unique_name(name or spec.name, link, names)
            topics = _topics(element, camera, own)
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
    for camera in sensor.findall("camera"):
        own = _lens_name(sensor, camera)
        yield f"{sensor.get('name', '')}{own and '_'}{own}", camera


def _lens_name(sensor: Element, camera: Element) -> str:
    """Return what tells one lens of a multicamera from the others; empty if there is one only."""
    found = sensor.findall("camera")
    return "" if len(found) < 2 else camera.get("name") or str(found.index(camera))


def _fault(camera: Element) -> str:
    """Return why a `<camera>` of a sensor is none, and what would be one; empty if it is one."""
    fov, sensor = _number(camera, "horizontal_fov"), camera.getparent()
    width, height = (_number(camera, f"image/{side}") for side in ("width", "height"))
    if not all(size == int(size) and 1 <= size <= MAX_PIXELS for size in (width, height)):
        return f"an image of {width:g} x {height:g} pixels; valid are whole numbers from 1 to {MAX_PIXELS}"
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
    sees, format_ = _SEES[kind_of(sensor)], text_of(camera, "image/format") or ""
    reach = _reach(sensor, camera, near, far) if sees & _DEPTH else (near, far)
    if not sees & _COLOUR:
        near, far = reach
    for low, high in dict.fromkeys(((near, far), reach)):
        if not 0.0 < low < high:
            add_fault(report, sensor, f" sees from {low:g} to {high:g} m; valid is 0 < near < far")
    if noise < 0.0:
        add_fault(report, sensor, f" has noise of {noise:g}; a deviation is not negative")
    coarse = text_of(camera, "depth_camera/format") or (format_ if not sees & _COLOUR else "")
    size = int(width), int(height)
    return CameraSpec(
        **common,
        horizontal_fov=fov,
        width=size[0],
        height=size[1],
        near=min(near, reach[0]),
        far=max(far, reach[1]),
        depth_range=None if reach == (near, far) else reach,
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
        intrinsics=None if kind_of(sensor) == _WIDE else _intrinsics(sensor, camera, size, report),
        baseline=_baseline(sensor, camera),
        exposure=_exposure(sensor, camera, report),
        wide=read_wide_lens(sensor, camera, size, fov, report) if kind_of(sensor) == _WIDE else None,
    )


def _reach(sensor: Element, camera: Element, near: float, far: float) -> tuple[float, float]:
    """Return between which depths are told [m]; colours are not cut off there."""
    low = number_in(first(camera, "depth_camera/clip/near"))
    high = number_in(first(camera, "depth_camera/clip/far"))
    if low is None:
        low = number_in(sensor.find("plugin/min_depth"))
    if high is None:
        high = number_in(sensor.find("plugin/max_depth"))
    return near if low is None else low, far if high is None else high


def _intrinsics(
    sensor: Element, camera: Element, size: tuple[int, int], report: Report
) -> tuple[float, float, float, float] | None:
    """Return fx, fy, cx and cy of `<lens><intrinsics>`; None if the field of view tells them."""
    said = camera.find("lens/intrinsics")
    if said is None:
        return None
    fx, fy, skew = (_number_at(said, name, 0.0) for name in ("fx", "fy", "s"))
    if skew or min(fx, fy) <= 0.0:
        add_fault(report, sensor, " has <intrinsics> with fx and fy not both positive, or s not 0")
        return None
    return fx, fy, _number_at(said, "cx", (size[0] - 1) / 2.0), _number_at(said, "cy", (size[1] - 1) / 2.0)


def _baseline(sensor: Element, camera: Element) -> float:
    """Return how far a camera is to the right of the left one of a stereo pair [m].

    The plugin of ROS 1 tells it of the right lens of a multicamera only, which is what CameraInfo means;
    that of ROS 2 of all of them.
    """
    given = number_in(first(sensor, "plugin/hack_baseline", "plugin/hackBaseline"))
    all_ = sensor.findall("camera")
    left = next((lens for lens in all_ if "left" in lens.get("name", "")), all_[0])
    return 0.0 if given is None or (len(all_) > 1 and camera is left) else given


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


def _topics(sensor: Element, camera: Element, name: str) -> CameraTopics:
    """Return the topics, below the camera's name unless the file says otherwise.

    `<topic>` of new Gazebo is that of the images, or for a camera of colours and depth what all are below.
    Each lens of a multicamera has topics of its own, below its name, as Gazebo's plugins have it.
    """
    lens, plugin = _lens_name(sensor, camera), sensor.find("plugin")
    own = _relative(text_of(sensor, "plugin/camera_name", "plugin/cameraName"))
    if lens and (own or plugin is not None):
        own = f"{own or sensor.get('name', '')}/{lens}"
    own = own or name
    space = _relative(text_of(sensor, "plugin/ros/namespace"))
    base = f"{space}/{own}" if space else own
    given = _relative(text_of(sensor, "topic"))
    sees = _SEES[kind_of(sensor)]
    if given and not sees:
        topics = replace(CameraTopics.below(given), **CameraTopics.of_truth(given))
        if kind_of(sensor).startswith("boundingbox"):
            topics = replace(topics, boxes=given)
    elif given and lens:
        topics = CameraTopics.below(f"{given}/{lens}")
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
    info = _relative(text_of(camera, "camera_info_topic"))
    if info:
        topics = replace(topics, **{"info" if sees != _DEPTH else "depth_info": info})
    return replace(topics, **_renamed(sensor, base, own, of_several=bool(lens)))


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


def _renamed(sensor: Element, base: str, own: str, *, of_several: bool) -> dict[str, str]:
    """Return the topics that a plugin names, by the field of `CameraTopics`.

    Args:
        sensor: Of the plugin.
        base: What its topics are below.
        own: The end of that, without a namespace.
        of_several: Whether it is a lens of a multicamera: a name without the lens's is of all, so of none.
    """
    named = {}
    for part, tags in _PARTS.items():
        text = text_of(sensor, *(f"plugin/{tag}" for tag in tags))
        if text:
            named_base = of_several or sensor.find("plugin/cameraName") is not None
            below = named_base and not text.startswith("/")
            named[part] = f"{base}/{_relative(text)}" if below else _relative(text)
    for rule in sensor.iterfind("plugin/ros/remapping"):
        before, _, after = (rule.text or "").strip().partition(":=")
        plain = _relative(before).removeprefix(f"{own}/")
        if of_several and plain == _relative(before):
            continue
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
