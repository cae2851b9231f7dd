"""A lidar that can fail in the ways that real ones do."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from twin.sensors.lidar import Lidar, LidarReading, LidarSpec

LidarFailure = Literal["stop", "freeze", "nan", "blind"]
"""No reading; the last one again; nothing but NaN; nothing but inf."""


class FailingLidar:
    """Stands in for a lidar; as long as `failure` is None it is that lidar."""

    def __init__(self, lidar: Lidar) -> None:
        self.spec: LidarSpec = lidar.spec
        self.failure: LidarFailure | None = None
        self._lidar = lidar
        self._last: LidarReading | None = None

    def sample(self, time_ns: int) -> LidarReading | None:
        """Return a reading; None: the lidar is silent."""
        if self.failure == "stop":
            return None
        if self.failure == "freeze" and self._last is not None:
            return replace(self._last, time_ns=time_ns)
        self._last = reading = self._lidar.sample(time_ns)
        if self.failure in ("nan", "blind"):
            value = np.nan if self.failure == "nan" else np.inf
            return replace(reading, ranges=np.full_like(reading.ranges, value))
        return reading
