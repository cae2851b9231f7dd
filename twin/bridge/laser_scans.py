"""A cloud as the planar scan that a slice of it is, as pointcloud_to_laserscan makes it.

The other way, from a scan to a cloud, is `project_laser` in `twin/bridge/tf/transforms.py`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.bridge.msgs import LaserScan, PointCloud2
from twin.bridge.point_cloud2 import read_points
from twin.clouds.points import coordinates, measured
from twin.errors import BridgeError

_MOST_RAYS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class SliceConfig:
    """Which points of a cloud are in the scan; names and defaults are pointcloud_to_laserscan's."""

    min_height: float = -math.inf
    """Of z in the cloud's frame [m]."""
    max_height: float = math.inf
    """Of z [m]."""
    angle_min: float = -math.pi
    """[rad]"""
    angle_max: float = math.pi
    """[rad]"""
    angle_increment: float = math.pi / 180.0
    """[rad]"""
    scan_time: float = 1.0 / 30.0
    """[s]"""
    range_min: float = 0.0
    """[m]"""
    range_max: float = math.inf
    """[m]"""
    use_inf: bool = True
    """A ray that meets no point has inf; else `range_max` and `inf_epsilon`."""
    inf_epsilon: float = 1.0
    """[m]"""

    def __post_init__(self) -> None:
        low, high, step = self.angle_min, self.angle_max, self.angle_increment
        if not (step > 0.0 and 0.0 < (high - low) / step <= _MOST_RAYS):
            raise BridgeError(
                f"from {low:g} to {high:g} rad by {step:g} rad is no scan; valid are 1 to {_MOST_RAYS} rays"
            )


def scan_of(cloud: PointCloud2, config: SliceConfig | None = None) -> LaserScan:
    """Return the nearest point in each direction as a scan in the cloud's own frame.

    Raises:
        BridgeError: The cloud is not well-formed, or has no x, y, z.
    """
    config = config or SliceConfig()
    x, y, z = coordinates(measured(read_points(cloud, ("x", "y", "z")))).T
    distance, angle = np.hypot(x, y), np.arctan2(y, x)
    kept = (z >= config.min_height) & (z <= config.max_height)
    kept &= (distance >= config.range_min) & (distance <= config.range_max)
    kept &= (angle >= config.angle_min) & (angle <= config.angle_max)
    rays = math.ceil((config.angle_max - config.angle_min) / config.angle_increment)
    ray = ((angle[kept] - config.angle_min) / config.angle_increment).astype(np.intp)
    ranges = np.full(rays, math.inf if config.use_inf else config.range_max + config.inf_epsilon)
    np.minimum.at(ranges, np.minimum(ray, rays - 1), distance[kept])
    return LaserScan(
        header=cloud.header,
        angle_min=config.angle_min,
        angle_max=config.angle_max,
        angle_increment=config.angle_increment,
        time_increment=0.0,
        scan_time=config.scan_time,
        range_min=config.range_min,
        range_max=config.range_max,
        ranges=ranges.astype(np.float32),
        intensities=np.zeros(0, np.float32),
    )
