"""Lidars that are mounted, wired or stamped wrongly, or worn out; all of them on `scan`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from twin.bridge.msgs import Header, ns, stamp
from twin.experiments.mutants.mutant import Mutant, Site
from twin.sim.noise import NoiseStream

_SCAN = "scan"


class LidarYaw(Mutant):
    """The lidar is mounted 8 degrees askew."""

    def install(self, site: Site) -> None:
        """Turn the scan."""
        turn = math.radians(8.0)
        site.rewrite(_SCAN, lambda m: replace(m, angle_min=m.angle_min + turn, angle_max=m.angle_max + turn))


class LidarMirrored(Mutant):
    """The lidar is mounted upside down."""

    def install(self, site: Site) -> None:
        """Let left be right."""
        site.rewrite(_SCAN, lambda m: replace(m, ranges=m.ranges[::-1].copy()))


class LidarFrame(Mutant):
    """The lidar's frame in the robot's file is half a metre behind where it is."""

    def install(self, site: Site) -> None:
        """Move it in what is told of fixed joints."""
        frames = {
            spec.link for robot in site.robots for spec in robot.description.sensors if spec.topic == _SCAN
        }

        def moved(message: Any) -> Any:
            return replace(
                message,
                transforms=[
                    _back(each, 0.5) if each.child_frame_id.rpartition("/")[2] in frames else each
                    for each in message.transforms
                ],
            )

        site.rewrite("tf_static", moved)
        site.rewrite(_SCAN, lambda message: message)  # there must be one


def _back(transform: Any, distance: float) -> Any:
    place = transform.transform.translation
    return replace(
        transform, transform=replace(transform.transform, translation=replace(place, x=place.x - distance))
    )


class LidarScale(Mutant):
    """The lidar takes everything to be 10 % farther than it is."""

    def install(self, site: Site) -> None:
        """Scale the ranges."""
        site.rewrite(_SCAN, lambda m: replace(m, ranges=m.ranges * np.float32(1.1)))


class DeadRays(Mutant):
    """The lidar is blind on its left half: nothing comes back there."""

    def install(self, site: Site) -> None:
        """Let half of the rays have no return."""

        def half(message: Any) -> Any:
            ranges = message.ranges.copy()
            ranges[len(ranges) // 2 :] = np.inf
            return replace(message, ranges=ranges)

        site.rewrite(_SCAN, half)


class NoisyLidar(Mutant):
    """The lidar's ranges have 0.3 m of noise."""

    def install(self, site: Site) -> None:
        """Add it."""
        noise, count = NoiseStream(site.world.seed, "noisy_lidar"), iter(range(1 << 62))

        def noisy(message: Any) -> Any:
            drawn = 0.3 * noise.normal(next(count), len(message.ranges))
            return replace(message, ranges=np.abs(message.ranges + drawn).astype(np.float32))

        site.rewrite(_SCAN, noisy)


class FrozenLidar(Mutant):
    """After 5 s the lidar repeats its last scan, with new stamps."""

    def install(self, site: Site) -> None:
        """Keep a scan."""
        kept: list[Any] = []

        def frozen(message: Any) -> Any:
            if ns(message.header.stamp) < 5_000_000_000 or not kept:
                kept[:] = [message]
            return replace(message, ranges=kept[0].ranges)

        site.rewrite(_SCAN, frozen)


class LateStamps(Mutant):
    """Scans are stamped 0.4 s too late: they seem to come from the future."""

    def install(self, site: Site) -> None:
        """Change the stamps."""
        site.rewrite(_SCAN, lambda message: _stamped(message, 400_000_000))


class EarlyStamps(Mutant):
    """Scans are stamped 0.4 s too early: they seem to be old."""

    def install(self, site: Site) -> None:
        """Change the stamps."""
        site.rewrite(_SCAN, lambda message: _stamped(message, -400_000_000))


def _stamped(message: Any, offset_ns: int) -> Any:
    time_ns = max(0, ns(message.header.stamp) + offset_ns)
    return replace(message, header=Header(stamp(time_ns), message.header.frame_id))
