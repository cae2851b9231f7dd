"""Lidars that are mounted, wired or stamped wrongly, or worn out; all of them on `scan`."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np

from twin.bridge.msgs import Header, ns, stamp
from twin.experiments.mutants.catalogue import installs, rewrites
from twin.experiments.mutants.mutant import Site
from twin.sim.noise import NoiseStream

_SCAN = "scan"


@rewrites(_SCAN)
def lidar_yaw(message: Any) -> Any:
    """The lidar is mounted 8 degrees askew."""
    turn = math.radians(8.0)
    return replace(message, angle_min=message.angle_min + turn, angle_max=message.angle_max + turn)


@rewrites(_SCAN)
def lidar_mirrored(message: Any) -> Any:
    """The lidar is mounted upside down."""
    return replace(message, ranges=message.ranges[::-1].copy())


@installs
def lidar_frame(site: Site) -> None:
    """The lidar's frame in the robot's file is half a metre behind where it is."""
    sensors = [spec for robot in site.robots for spec in robot.description.sensors]
    frames = {spec.link for spec in sensors if spec.topic == _SCAN}

    def moved(message: Any) -> Any:
        told = [
            _back(each, 0.5) if each.child_frame_id.rpartition("/")[2] in frames else each
            for each in message.transforms
        ]
        return replace(message, transforms=told)

    site.rewrite("tf_static", moved)
    site.rewrite(_SCAN, lambda message: message)  # there must be one


def _back(transform: Any, distance: float) -> Any:
    inner = transform.transform
    place = replace(inner.translation, x=inner.translation.x - distance)
    return replace(transform, transform=replace(inner, translation=place))


@rewrites(_SCAN)
def lidar_scale(message: Any) -> Any:
    """The lidar takes everything to be 10 % farther than it is."""
    return replace(message, ranges=message.ranges * np.float32(1.1))


@rewrites(_SCAN)
def dead_rays(message: Any) -> Any:
    """The lidar is blind on its left half: nothing comes back there."""
    ranges = message.ranges.copy()
    ranges[len(ranges) // 2 :] = np.inf
    return replace(message, ranges=ranges)


@installs
def noisy_lidar(site: Site) -> None:
    """The lidar's ranges have 0.3 m of noise."""
    noise, numbers = NoiseStream(site.world.seed, "noisy_lidar"), count()

    def noisy(message: Any) -> Any:
        drawn = 0.3 * noise.normal(next(numbers), len(message.ranges))
        return replace(message, ranges=np.abs(message.ranges + drawn).astype(np.float32))

    site.rewrite(_SCAN, noisy)


@installs
def frozen_lidar(site: Site) -> None:
    """After 5 s the lidar repeats its last scan, with new stamps."""
    kept: list[Any] = []

    def frozen(message: Any) -> Any:
        if ns(message.header.stamp) < 5_000_000_000 or not kept:
            kept[:] = [message]
        return replace(message, ranges=kept[0].ranges)

    site.rewrite(_SCAN, frozen)


@rewrites(_SCAN)
def late_stamps(message: Any) -> Any:
    """Scans are stamped 0.4 s too late: they seem to come from the future."""
    return _stamped(message, 400_000_000)


@rewrites(_SCAN)
def early_stamps(message: Any) -> Any:
    """Scans are stamped 0.4 s too early: they seem to be old."""
    return _stamped(message, -400_000_000)


def _stamped(message: Any, offset_ns: int) -> Any:
    time_ns = max(0, ns(message.header.stamp) + offset_ns)
    return replace(message, header=Header(stamp(time_ns), message.header.frame_id))
