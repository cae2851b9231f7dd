"""An ultrasonic ranger."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array
from twin.models.specs import RangeSpec
from twin.sim.sensors.rays import RayCaster
from twin.sim.sensors.sensor import Mount

_RINGS = 5
"""Rings of rays around the axis; ring k has 6 k rays, 91 in all."""

_MAX_INCIDENCE = math.radians(70.0)
"""Sound that meets a smooth surface more obliquely than this is reflected away and gives no echo; so a ranger
that looks along the floor does not see the floor (Borenstein & Koren 1988 report the same of walls)."""


@dataclass(frozen=True, kw_only=True)
class RangeReading:
    """One echo."""

    time_ns: int
    range: float
    """[m]; REP-117: +inf is no echo, -inf nearer than range_min."""


def cone(field_of_view: float) -> Array:
    """Return unit vectors that fill a cone of full angle `field_of_view` [rad] about +x, shape (91, 3)."""
    rays = [(1.0, 0.0, 0.0)]
    for ring in range(1, _RINGS + 1):
        tilt = field_of_view / 2.0 * ring / _RINGS
        for k in range(6 * ring):
            turn = 2.0 * math.pi * k / (6 * ring)
            rays.append((math.cos(tilt), math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn)))
    return np.array(rays)


class Range:
    """Reports the nearest echo of a cone of rays about its link's x axis."""

    def __init__(self, spec: RangeSpec, mount: Mount) -> None:
        self.spec = spec
        self._rays = RayCaster(mount, cone(spec.field_of_view), cutoff=spec.range_max)
        self._noise = mount.noise(spec.name)
        self._world = mount.world

    def sample(self, time_ns: int) -> RangeReading:
        """Listen."""
        spec = self.spec
        distance = self._rays.cast()
        cosine = np.abs(np.einsum("ij,ij->i", self._rays.normals, self._rays.directions))
        nearest = float(np.min(distance, where=cosine >= math.cos(_MAX_INCIDENCE), initial=np.inf))
        if nearest < spec.range_min:
            return RangeReading(time_ns=time_ns, range=-math.inf)
        if nearest > spec.range_max:
            return RangeReading(time_ns=time_ns, range=math.inf)
        noise = float(self._noise.normal(time_ns // self._world.timestep_ns, 1)[0])
        return RangeReading(time_ns=time_ns, range=nearest + spec.noise_stddev * noise)
