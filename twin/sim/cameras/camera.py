"""A camera of a robot in a world: what it sees, with its lens and its noise."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.models.specs import CameraSpec
from twin.sim.cameras.depth_noise import noisy
from twin.sim.cameras.exposure import LUMA, ExposureControl
from twin.sim.cameras.labels import Labels
from twin.sim.cameras.remap import Source
from twin.sim.sensors import Mount

_ENCODED = {"rgb8": slice(None), "bgr8": slice(None, None, -1)}


class View(NamedTuple):
    """What a camera sees; what was not asked for is None."""

    colours: NDArray[np.uint8] | None
    """In its encoding, shape (height, width, 3), or (height, width) of `mono8`."""
    depth: NDArray[np.float32] | None
    """z along the optical axis [m], shape (height, width); nan where there is none."""


class Camera:
    """Looks along +x of its link, or of its own pose in it."""

    def __init__(self, spec: CameraSpec, mount: Mount) -> None:
        """Take what the file says of it, and where it is; nothing is drawn before it is asked.

        Raises:
            ModelError: It is faster than the physics.
        """
        mount.check_rate(spec)
        self.spec, self.mount = spec, mount
        self._noise = mount.noise(spec.name)
        self._depth_noise = mount.noise(spec.name, "depth")
        self._exposure = None if spec.exposure is None else ExposureControl(spec.exposure)
        self._shot_noise = mount.noise(spec.name, "exposure")

    @cached_property
    def source(self) -> Source:
        """The image that is drawn, of which a lens makes its own."""
        return Source(self.spec.lens)

    def open(self) -> None:
        """See that it can look.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        world = self.mount.world
        _ = world.eyes if self.spec.truth is None else world.true_eyes

    def look(self, time_ns: int, *, colours: bool = True, depth: bool = False) -> View:
        """Return what it sees; `time_ns` is the world's time.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        spec, tick = self.spec, time_ns // self.mount.world.timestep_ns
        rgb, z = self.mount.world.eyes.look(self, colours=colours, depth=depth)
        seen = distance = None
        if colours:
            taken = self.source.smooth(rgb)
            if self._exposure is not None:
                self._exposure.meter(taken, time_ns, self.source.lit)
                grain = self._shot_noise.normal(tick, taken.size).reshape(taken.shape)
                taken = self._exposure.exposed(taken, grain)
            seen = self._encoded(taken)
            if spec.noise_stddev or spec.noise_mean:
                grain = self._noise.normal(tick, seen.size).reshape(seen.shape)
                grey = seen + 255.0 * (spec.noise_mean + spec.noise_stddev * grain)
                seen = np.clip(np.rint(grey), 0.0, 255.0).astype(np.uint8)
        if depth:
            distance = self.source.nearest(z)
            if spec.depth_range is not None:
                nearest, farthest = spec.depth_range
                distance[(distance < nearest) | (distance > farthest)] = np.nan
            if spec.depth_noise is not None:
                grain = self._depth_noise.normal(tick, distance.size).reshape(distance.shape)
                distance = noisy(distance, spec.depth_noise, spec.lens.focal_length, grain)
        return View(seen, distance)

    @property
    def labels(self) -> Labels:
        """What the numbers of `things` mean.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        return self.mount.world.true_eyes.labels

    def things(self) -> NDArray[np.uint16]:
        """Return the number of the thing that each pixel shows now, shape (height, width).

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        return self.source.nearest(self.mount.world.true_eyes.things(self), nothing=0)

    def _encoded(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self.spec.encoding == "mono8":
            return np.rint(rgb @ LUMA).astype(np.uint8)
        return np.ascontiguousarray(rgb[..., _ENCODED[self.spec.encoding]])
