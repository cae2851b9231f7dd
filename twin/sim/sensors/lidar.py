"""A planar lidar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Array
from twin.models.specs import LidarSpec
from twin.sim.sensors.rays import RayCaster
from twin.sim.sensors.sensor import Mount


@dataclass(frozen=True, kw_only=True)
class LidarReading:
    """One scan."""

    time_ns: int
    ranges: Array
    """From angle_min to angle_max, shape (samples,) [m].

    As REP-117 says: +inf where nothing returns, -inf where something is nearer than range_min.
    """


class Lidar:
    """Casts rays in the x-y plane of its link against collision shapes; its own link is not seen."""

    def __init__(self, spec: LidarSpec, mount: Mount) -> None:
        self.spec = spec
        angles = np.linspace(spec.angle_min, spec.angle_max, spec.samples)
        directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(spec.samples)))
        self._rays = RayCaster(mount, directions, cutoff=spec.range_max)
        self._noise = mount.noise(spec.name)
        self._world = mount.world

    def sample(self, time_ns: int) -> LidarReading:
        """Scan; all rays are cast at the same time."""
        spec = self.spec
        distance = self._rays.cast()
        ranges = distance
        if spec.noise_stddev > 0.0:
            noise = self._noise.normal(time_ns // self._world.timestep_ns, spec.samples)
            ranges = distance + spec.noise_stddev * noise
        ranges = np.where(distance > spec.range_max, np.inf, ranges)
        return LidarReading(time_ns=time_ns, ranges=np.where(distance < spec.range_min, -np.inf, ranges))
