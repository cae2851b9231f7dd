"""Sensors that say nothing, or the same again, or say it late."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from twin.bridge.msgs import PointCloud2
from twin.bridge.point_cloud2 import cloud_of, read_points
from twin.clouds.points import XYZ
from twin.faults.fault import Effect, FaultContext, refuse
from twin.faults.messages import Counted, linked
from twin.faults.quantities import altered, values_of, with_field
from twin.faults.readings import ReadingConfig, ReadingFault
from twin.geometry import Array
from twin.parameters import Fraction, Positive, Seconds, Share
from twin.scenario.faults import LastingRobotFault
from twin.sensors.clouds.cloud_lidar import CloudLidar
from twin.sensors.lidar import Lidar


class Dropout(ReadingFault):
    """A sensor has nothing to say now and then, or some of its values are missing."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ReadingConfig):
        """Readings, or values, that are missing."""

        share: Annotated[Share, Fraction]
        """Of the readings, or of the values, that are missing; each on its own."""
        of: Literal["readings", "values"] = "readings"
        """`readings`: nothing is said (joints: the last reading again). `values`: single numbers of an array,
        such as rays of a scan, are NaN; of a cloud, points are left out."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self._stream = self.noise(config.sensor)
        self.did = "dropped" if config.of == "readings" else "with missing values"
        has_values = isinstance(values_of(self.example).get(self.measures), np.ndarray)
        if config.of == "values" and not (has_values or isinstance(self.example, PointCloud2)):
            raise refuse("of", f"sensor '{config.sensor}' measures no array of values; valid is readings")

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return the reading, or what is left of it."""
        tick, share = self.tick(time_ns), self.config.share
        if self.config.of == "readings":
            return None if self._stream.uniform(tick, 1)[0] < share else reading
        if isinstance(reading, PointCloud2):
            points = read_points(reading)
            return cloud_of(reading.header, points[self._stream.uniform(tick, len(points)) >= share])

        def without(values: Array) -> Array:
            return np.where(self._stream.uniform(tick, len(values)) < share, math.nan, values)

        return altered(reading, self.measures, without)


class Freeze(ReadingFault):
    """A sensor says the last reading again and again, with new stamps."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ReadingConfig):
        """A sensor that says the same again and again."""

    _last: Any = None
    did = "frozen"

    def saw(self, reading: Any) -> None:
        """Keep a reading."""
        self._last = reading

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return the last one with the stamp of now."""
        if self._last is None:
            self._last = reading
        now = getattr(reading, "header", None)
        return self._last if now is None else with_field(self._last, "header", now)


class Delay(ReadingFault):
    """What a sensor measures is told late, with the stamp of its time."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ReadingConfig):
        """A sensor that is late."""

        time: Annotated[Seconds, Positive]
        """By how much [s]; nodes hear of it at the first control period after that."""

    did = "late"

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self._delay_ns = round(config.time * 1e9)
        self._past: deque[tuple[int, Any]] = deque()
        self._link: Counted | None = None
        if self.publisher is not None:
            node = self.publisher.node
            own = node.resolve_name(config.sensor), node.fully_qualified_name
            self._link = Counted(lambda heard: (self._delay_ns,), lambda h: (h.topic, h.sender) == own)

    @property
    def effect(self) -> Effect:
        """How many readings came late."""
        if self._link is None:
            return super().effect
        return Effect(self._link.changed > 0, self._link.told(f"readings of {self.config.sensor}", self.did))

    def begin(self) -> None:
        """Hold back what is measured from now on."""
        if self._link is None:
            super().begin()
        else:
            linked(self.context.bus).append(self._link)

    def end(self) -> None:
        """Hold back no more."""
        if self._link is None:
            super().end()
        else:
            linked(self.context.bus).remove(self._link)

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return what the joints were so long ago."""
        self._past.append((time_ns, reading))
        found = None
        while self._past and self._past[0][0] <= time_ns - self._delay_ns:
            found = self._past.popleft()[1]
        return found


class LidarFailure(Freeze):
    """A lidar delivers nothing, or nothing of use."""

    devices = Lidar, CloudLidar

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A lidar delivers nothing, or nothing of use."""

        sensor: str = "scan"
        """Topic of the lidar."""
        kind: Literal["stop", "freeze", "nan", "blind"]
        """`stop`: no scan comes. `freeze`: the last one comes again and again, with new stamps. `nan`: every
        reading, or point of a cloud, is NaN. `blind`: every reading is inf, as if nothing were there, and a
        cloud is empty."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        what = f"lidar '{config.sensor}' of {self.robot.name}"
        self.text, self.end_text = f"{what}: {config.kind}", f"{what} works again"
        self.did = {"stop": "dropped", "freeze": "frozen"}.get(config.kind, f"all {config.kind}")

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return what a lidar that fails says."""
        if self.config.kind == "stop":
            return None
        if self.config.kind == "freeze":
            return super().alter(reading, time_ns)
        if isinstance(reading, PointCloud2):
            points = read_points(reading)
            if self.config.kind == "blind":
                return cloud_of(reading.header, points[:0])
            points = points.copy()
            for axis in XYZ:
                points[axis] = math.nan
            return cloud_of(reading.header, points)
        value = math.nan if self.config.kind == "nan" else math.inf
        return altered(reading, "ranges", lambda values: np.full_like(values, value))
