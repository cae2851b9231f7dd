"""A spinning lidar with several layers of rays, such as a Velodyne VLP-16 or an Ouster OS0-32."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from twin.geometry import Array
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.sensors import FRAME_TAGS, Common, add_fault, required_number
from twin.sensors.clouds.cloud_lidar import MAX_RAYS, CloudLidar, CloudLidarSpec
from twin.sensors.clouds.layouts import LAYOUTS, Driver
from twin.sensors.ray_elements import ray_child, read_method, read_noise, read_reach
from twin.sim.sensors import Mount
from twin.sim.sensors.depth_images import DepthImages, size_of
from twin.sim.sensors.rays import RayCaster

MOST_PIXELS = 4096
"""Along an edge of a depth image."""
_DRIVERS: dict[str, Driver] = {
    f"gazebo_ros_{driver}_{processor}laser": driver
    for driver in ("velodyne", "ouster")
    for processor in ("", "gpu_")
}


@dataclass(frozen=True, kw_only=True)
class MultiLayerLidarSpec(CloudLidarSpec):
    """A lidar that turns from angle_min to angle_max with `layers` rays one above the other."""

    kind: ClassVar[str] = "multi_layer_lidar"
    angle_min: float
    """[rad]"""
    angle_max: float
    """[rad]; included."""
    columns: int
    """Directions in a turn."""
    elevation_min: float
    """Of the lowest layer [rad]."""
    elevation_max: float
    """Of the highest layer [rad]."""
    layers: int

    @property
    def rays(self) -> int:
        """Of a turn."""
        return self.columns * self.layers

    @property
    def most_groups(self) -> int:
        """A column is measured at once."""
        return self.columns

    @property
    def step(self) -> float:
        """The smaller angle from a ray to its neighbour, along a turn or from layer to layer [rad]."""
        steps = (
            (self.angle_max - self.angle_min) / max(1, self.columns - 1),
            (self.elevation_max - self.elevation_min) / max(1, self.layers - 1),
        )
        return min((step for step in steps if step > 0.0), default=math.radians(1.0))

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of each depth image, if it looks at such [pixels]."""
        return size_of(self.step, max(abs(self.elevation_min), abs(self.elevation_max)))


class MultiLayerLidar(CloudLidar):
    """Casts columns of rays group by group while it turns, or takes all from four depth images."""

    @classmethod
    def asks_for_cloud(cls, element: Element) -> bool:
        """Whether a plugin of classic Gazebo makes clouds, and nothing else, of a `<sensor>`."""
        return any(
            library_of(plugin) in _DRIVERS or text_of(plugin, "output_type") == "sensor_msgs/PointCloud2"
            for plugin in element.findall("plugin")
        )

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> MultiLayerLidarSpec:
        """Read `<ray>` or `<lidar>` with `<vertical>`; without it there is one level layer."""
        across, upwards = (ray_child(element, f"scan/{way}") for way in ("horizontal", "vertical"))
        columns = required_number(element, across, "samples", report)
        low, high = (required_number(element, across, f"{end}_angle", report) for end in ("min", "max"))
        layers, down, up = 1.0, 0.0, 0.0
        if upwards is not None:  # with SDFormat's defaults
            layers, down, up = (
                report.child_number(upwards, name) or default
                for name, default in (("samples", 1.0), ("min_angle", 0.0), ("max_angle", 0.0))
            )
        if min(columns, layers) < 1 or columns * layers > MAX_RAYS or columns % 1 or layers % 1:
            valid = f"whole numbers, whose product is at most {MAX_RAYS}"
            add_fault(report, element, f" has {columns:g} x {layers:g} samples; valid are {valid}")
            columns = layers = 1.0
        if low > high or down > up:
            add_fault(report, element, ": min_angle is above max_angle")
        range_min, range_max = read_reach(element, report)
        nearest = report.child_number(element, "plugin/min_range", "plugin/minRange")
        farthest = report.child_number(element, "plugin/max_range", "plugin/maxRange")
        drivers = (_DRIVERS.get(library_of(plugin)) for plugin in element.findall("plugin"))
        spec = MultiLayerLidarSpec(
            **common,
            angle_min=low,
            angle_max=high,
            columns=int(columns),
            elevation_min=down,
            elevation_max=up,
            layers=int(layers),
            range_min=max(range_min, nearest or 0.0),
            range_max=min(range_max, farthest or range_max),
            noise_stddev=read_noise(element, report),
            driver=next(filter(None, drivers), "velodyne"),
            method=read_method(element, report, "rolling", "instant", "depth_images"),
            frame=text_of(element, *FRAME_TAGS),
        )
        if spec.method == "depth_images" and low <= high and down <= up:
            _check_images(spec, element, report)
        return spec

    def __init__(self, spec: MultiLayerLidarSpec, mount: Mount) -> None:
        azimuth = np.linspace(spec.angle_min, spec.angle_max, spec.columns)
        elevation = np.linspace(spec.elevation_min, spec.elevation_max, spec.layers)
        parts = [_directions(part, elevation) for part in np.array_split(azimuth, spec.groups)]
        super().__init__(spec, mount, [len(part) for part in parts])
        layers = np.arange(spec.layers)
        layout = LAYOUTS[spec.driver]
        self._blank[layout.layer] = np.tile(layers[::-1] if layout.from_above else layers, spec.columns)
        self._directions[:] = np.concatenate(parts).T
        self._parts = parts

    @cached_property
    def _eyes(self) -> list[DepthImages | RayCaster]:
        """What measures each group."""
        spec: MultiLayerLidarSpec = self.spec
        if spec.method == "depth_images":
            size, reach = spec.image_size, spec.range_max
            images = DepthImages(self.mount, self._parts[0], size=size, reach=reach, name=spec.name)
            self._directions[:] = images.own_directions.T
            return [images]
        return list(RayCaster.of_turn(self.mount, self._parts, cutoff=spec.range_max))

    def _look(self, group: int) -> tuple[Array, Array]:
        eyes = self._eyes[group]
        return eyes.cast(), eyes.cosines()


def _directions(azimuth: Array, elevation: Array) -> Array:
    """Return unit vectors column by column, from below, shape (n, 3)."""
    level = np.cos(elevation)
    rays = np.empty((len(azimuth), len(elevation), 3))
    rays[..., 0] = np.cos(azimuth)[:, np.newaxis] * level
    rays[..., 1] = np.sin(azimuth)[:, np.newaxis] * level
    rays[..., 2] = np.sin(elevation)
    return rays.reshape(-1, 3)


def _check_images(spec: MultiLayerLidarSpec, element: Element, report: Report) -> None:
    width, height = spec.image_size
    if max(width, height) > MOST_PIXELS:
        add_fault(
            report,
            element,
            f" needs depth images of {width} x {height} pixels; valid are at most {MOST_PIXELS} each way: "
            "larger steps, layers that are less steep, or <method>instant</method>",
        )
