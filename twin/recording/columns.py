"""Buffers that collect rows during a block of simulated time and send each entity with one call.

Rerun's cost is per call (70 µs for a `log`, about 200 µs for a `send_columns`), not per row; so every entity
is sent once a block. Importing this module imports rerun (0.6 s): only a run that records does.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
from numpy.typing import ArrayLike, NDArray

TIMELINE = "sim_time"
"""The one timeline: simulated time as a duration, from integer nanoseconds."""

Points = NDArray[np.float32]


def sim_time(times_ns: Sequence[int]) -> rr.TimeColumn:
    """Return an index column of simulated times [ns], without rounding through seconds."""
    return rr.TimeColumn(TIMELINE, duration=np.array(times_ns, dtype="timedelta64[ns]"))


class Columns(ABC):
    """Rows of one entity that wait to be sent."""

    def __init__(self, entity: str) -> None:
        self.entity = entity
        self._times: list[int] = []

    def __len__(self) -> int:
        return len(self._times)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send and forget the rows."""
        if self._times:
            recording.send_columns(self.entity, [sim_time(self._times)], self._take())
            self._times.clear()

    @abstractmethod
    def _take(self) -> Iterable[rr.ComponentColumn]:
        """Return the columns of all rows and clear them."""


class TransformColumns(Columns):
    """Poses of many named frames in one entity; one row is one frame at one time."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._parents: list[str] = []
        self._children: list[str] = []
        self._xyz: list[ArrayLike] = []
        self._quat_xyzw: list[ArrayLike] = []

    def append(
        self, time_ns: int, parent: str, children: list[str], xyz: ArrayLike, quat_xyzw: ArrayLike
    ) -> None:
        """Add the poses of `children` in `parent` at one time; `xyz` (n, 3) [m], `quat_xyzw` (n, 4)."""
        n = len(children)
        self._times += [time_ns] * n
        self._parents += [parent] * n
        self._children += children
        self._xyz.append(xyz)
        self._quat_xyzw.append(quat_xyzw)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        columns = rr.Transform3D.columns(
            translation=np.concatenate(self._xyz, dtype=np.float32),
            quaternion=np.concatenate(self._quat_xyzw, dtype=np.float32),
            parent_frame=pa.array(self._parents, pa.string()),
            child_frame=pa.array(self._children, pa.string()),
        )
        for rows in (self._parents, self._children, self._xyz, self._quat_xyzw):
            rows.clear()
        return columns


class PointColumns(Columns):
    """A point cloud per row."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._clouds: list[Points] = []

    def append(self, time_ns: int, points: Points) -> None:
        """Add a cloud, shape (n, 3) [m] in the frame of the entity."""
        self._times.append(time_ns)
        self._clouds.append(points)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        lengths = [len(cloud) for cloud in self._clouds]
        columns = rr.Points3D.columns(positions=np.concatenate(self._clouds)).partition(lengths)
        self._clouds.clear()
        return columns


class ArrowColumns(Columns):
    """A bundle of arrows per row."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._origins: list[Points] = []
        self._vectors: list[Points] = []

    def append(self, time_ns: int, origins: Points, vectors: Points) -> None:
        """Add a bundle; both shape (n, 3) [m] in the frame of the entity."""
        self._times.append(time_ns)
        self._origins.append(origins)
        self._vectors.append(vectors)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        lengths = [len(origins) for origins in self._origins]
        columns = rr.Arrows3D.columns(
            origins=np.concatenate(self._origins), vectors=np.concatenate(self._vectors)
        ).partition(lengths)
        self._origins.clear()
        self._vectors.clear()
        return columns


class StripColumns(Columns):
    """One line strip per row."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._strips: list[Points] = []

    def append(self, time_ns: int, points: Points) -> None:
        """Add a strip, shape (n, 3) [m] in the frame of the entity."""
        self._times.append(time_ns)
        self._strips.append(points)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        columns = rr.LineStrips3D.columns(strips=list(self._strips))
        self._strips.clear()
        return columns


class TrailColumns(Columns):
    """A path travelled, one segment per row; the view shows every segment up to the cursor."""

    def __init__(self, entity: str, step_m: float) -> None:
        super().__init__(entity)
        self._step_m = step_m
        self._last: tuple[float, float, float] | None = None
        self._segments: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = []

    def append(self, time_ns: int, x: float, y: float, z: float) -> None:
        """Add a position [m]; ignored until it is a step away from the last one kept."""
        point = (x, y, z)
        if self._last is None:
            self._last = point
        elif math.dist(point, self._last) >= self._step_m:
            self._times.append(time_ns)
            self._segments.append((self._last, point))
            self._last = point

    def _take(self) -> Iterable[rr.ComponentColumn]:
        columns = rr.LineStrips3D.columns(strips=np.array(self._segments, dtype=np.float32))
        self._segments.clear()
        return columns


class ScalarColumns(Columns):
    """A number per row."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._rows: list[float] = []

    def append(self, time_ns: int, value: float) -> None:
        """Add a number."""
        self._times.append(time_ns)
        self._rows.append(value)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        columns = rr.Scalars.columns(scalars=np.array(self._rows, dtype=np.float64))
        self._rows.clear()
        return columns


class StateColumns(Columns):
    """The name of a state per row."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._states: list[str] = []

    def append(self, time_ns: int, state: str) -> None:
        """Add the state entered at this time."""
        self._times.append(time_ns)
        self._states.append(state)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        columns = rr.StateChange.columns(state=self._states.copy())
        self._states.clear()
        return columns


class LogColumns(Columns):
    """A log line per row."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity)
        self._texts: list[str] = []
        self._levels: list[str] = []

    def append(self, time_ns: int, text: str, level: str) -> None:
        """Add a line; `level` is a `rerun.TextLogLevel`."""
        self._times.append(time_ns)
        self._texts.append(text)
        self._levels.append(level)

    def _take(self) -> Iterable[rr.ComponentColumn]:
        columns = rr.TextLog.columns(text=self._texts.copy(), level=self._levels.copy())
        self._texts.clear()
        self._levels.clear()
        return columns
