"""A lidar whose rays never go the same way twice, such as Livox's Mid-40 and Mid-360."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from twin.geometry import Array
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.packages import locate
from twin.models.urdf.sensors import FRAME_TAGS, Common, add_fault
from twin.sensors.clouds.cloud_lidar import MAX_RAYS, CloudLidar, CloudLidarSpec
from twin.sensors.clouds.patterns import PATTERNS, Pattern, read_table
from twin.sensors.ray_elements import read_method, read_noise, read_reach
from twin.sim.sensors import Mount
from twin.sim.sensors.rays import RayBuffers, RayCaster

_LIBRARIES = ("livox_laser_simulation", "ros2_livox")
_SAMPLES = 24_000
"""Shots of a cloud, as in Livox's own examples."""


@dataclass(frozen=True, kw_only=True)
class LivoxLidarSpec(CloudLidarSpec):
    """A lidar that shoots `samples` times for each cloud, along a pattern."""

    kind: ClassVar[str] = "livox_lidar"
    pattern: str
    """Name of a pattern that is built in, or a file of directions."""
    samples: int
    downsample: int = 1
    """Every so many shots is cast."""

    @property
    def rays(self) -> int:
        """Of a cloud."""
        return -(-self.samples // self.downsample)


class LivoxLidar(CloudLidar):
    """Casts group by group what the pattern has at that time of the run."""

    @classmethod
    def asks_for_it(cls, element: Element) -> bool:
        """Whether a plugin of classic Gazebo makes one of a `<sensor>`."""
        return any(library_of(plugin) in _LIBRARIES for plugin in element.findall("plugin"))

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> LivoxLidarSpec:
        """Read the elements of Livox's plugin."""
        samples, downsample = (
            usual if number is None else number
            for usual, number in (
                (float(_SAMPLES), report.child_number(element, "plugin/samples")),
                (1.0, report.child_number(element, "plugin/downsample")),
            )
        )
        if samples % 1 or not 1 <= samples <= MAX_RAYS:
            add_fault(
                report, element, f" has {samples:g} samples; valid is a whole number from 1 to {MAX_RAYS}"
            )
            samples = 1.0
        if downsample % 1 or not 1 <= downsample <= samples:
            valid = f"a whole number from 1 to the number of samples, {samples:g}"
            add_fault(report, element, f" has downsample {downsample:g}; valid is {valid}")
            downsample = 1.0
        range_min, range_max = read_reach(element, report)
        return LivoxLidarSpec(
            **common,
            range_min=range_min,
            range_max=range_max,
            noise_stddev=read_noise(element, report),
            driver="livox",
            method=read_method(element, report, "rolling", "instant"),
            frame=text_of(element, *FRAME_TAGS),
            pattern=_read_pattern(element, report),
            samples=int(samples),
            downsample=int(downsample),
        )

    def __init__(self, spec: LivoxLidarSpec, mount: Mount) -> None:
        shots = np.arange(0.0, spec.samples, spec.downsample)
        self._shots = np.array_split(shots, spec.groups)
        super().__init__(spec, mount, [len(part) for part in self._shots])

    @cached_property
    def _pattern(self) -> Pattern:
        spec: LivoxLidarSpec = self.spec
        pattern = PATTERNS.get(spec.pattern) or read_table(Path(spec.pattern))
        self._blank["line"] = np.concatenate(self._shots) % pattern.lines
        return pattern

    @cached_property
    def _rays(self) -> list[RayCaster]:
        room = RayBuffers.of(max(map(len, self._shots)))
        return [
            RayCaster(
                self.mount, np.zeros((len(part), 3)), cutoff=self.spec.range_max, aims=True, buffers=room
            )
            for part in self._shots
        ]

    def _look(self, group: int) -> tuple[Array, Array]:
        spec: LivoxLidarSpec = self.spec
        shots = self._shots[group] + float(self._sweep.number * spec.samples)
        directions = self._pattern.directions(shots, spec.samples * spec.rate_hz)
        self._directions[:, self._slices[group]] = directions.T
        rays = self._rays[group]
        rays.aim(directions)
        return rays.cast(), rays.cosines()


def _read_pattern(element: Element, report: Report) -> str:
    """Return the pattern of `<csv_file_name>`: the file, or what is built in for one of its name."""
    named = text_of(element, "plugin/csv_file_name")
    known = ", ".join(f"{name}.csv" for name in PATTERNS)
    if named is None:
        add_fault(report, element, f" has no <csv_file_name>; valid is a file, or one of {known}")
        return next(iter(PATTERNS))
    stem = named.rpartition("/")[2].removesuffix(".csv").lower()
    assert report.packages is not None
    found = locate(named, report.source, report.packages)
    if found.path is None:
        if stem not in PATTERNS or found.code == "outside-path":
            add_fault(report, element, f": '{named}' {found.reason}; built in are {known}")
        return stem
    try:
        read_table(found.path)
    except ValueError as fault:
        add_fault(report, element, f": '{named}' {fault}")
    return str(found.path)
