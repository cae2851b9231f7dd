"""Buffers that collect rows during a block of simulated time and send each entity with one call.

Rerun's cost is per call (70 µs for a `log`, about 200 µs for a `send_columns`), not per row; so every entity
is sent once a block. Importing this module imports rerun (0.6 s): only a run that records does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from typing import Generic, TypeVarTuple

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
from numpy.typing import ArrayLike, NDArray

TIMELINE = "sim_time"
"""The one timeline: simulated time as a duration, from integer nanoseconds."""

Points = NDArray[np.float32]
"""Shape (n, 3) [m] in the frame of the entity."""
Point = tuple[float, float, float]
Row = TypeVarTuple("Row")


def sim_time(times_ns: Sequence[int]) -> rr.TimeColumn:
    """Return an index column of simulated times [ns], without rounding through seconds."""
    return rr.TimeColumn(TIMELINE, duration=np.array(times_ns, dtype="timedelta64[ns]"))


class Columns(Generic[*Row]):
    """Rows of one entity that wait to be sent."""

    def __init__(
        self, entity: str, make: Callable[[list[tuple[*Row]]], Iterable[rr.ComponentColumn]]
    ) -> None:
        """Start empty; `make` turns rows into Rerun's columns."""
        self.entity = entity
        self._make = make
        self._times: list[int] = []
        self._rows: list[tuple[*Row]] = []

    def append(self, time_ns: int, *row: *Row) -> None:
        """Add a row at a time [ns]."""
        self._times.append(time_ns)
        self._rows.append(row)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send and forget the rows."""
        if self._rows:
            recording.send_columns(self.entity, [sim_time(self._times)], self._make(self._rows))
            self._times.clear()
            self._rows.clear()


def points(rows: list[tuple[Points]]) -> Iterable[rr.ComponentColumn]:
    """Return a point cloud per row."""
    clouds = [cloud for (cloud,) in rows]
    return rr.Points3D.columns(positions=np.concatenate(clouds)).partition(list(map(len, clouds)))


def arrows(rows: list[tuple[Points, Points]]) -> Iterable[rr.ComponentColumn]:
    """Return a bundle of arrows per row, of origins and vectors."""
    origins, vectors = zip(*rows, strict=True)
    columns = rr.Arrows3D.columns(origins=np.concatenate(origins), vectors=np.concatenate(vectors))
    return columns.partition(list(map(len, origins)))


def strips(rows: list[tuple[Points]]) -> Iterable[rr.ComponentColumn]:
    """Return one line strip per row."""
    return rr.LineStrips3D.columns(strips=[strip for (strip,) in rows])


def scalars(rows: list[tuple[float]]) -> Iterable[rr.ComponentColumn]:
    """Return a number per row."""
    return rr.Scalars.columns(scalars=np.array(rows, dtype=np.float64).ravel())


def states(rows: list[tuple[str]]) -> Iterable[rr.ComponentColumn]:
    """Return the name of a state that is entered per row."""
    return rr.StateChange.columns(state=[state for (state,) in rows])


def log_lines(rows: list[tuple[str, str]]) -> Iterable[rr.ComponentColumn]:
    """Return a line and its `rerun.TextLogLevel` per row."""
    texts, levels = zip(*rows, strict=True)
    return rr.TextLog.columns(text=texts, level=levels)


class TransformColumns(Columns[str, list[str], ArrayLike, ArrayLike]):
    """Poses of many named frames in one entity; one row is one frame at one time."""

    def __init__(self, entity: str) -> None:
        super().__init__(entity, _poses)

    def append(
        self, time_ns: int, parent: str, children: list[str], xyz: ArrayLike, quat_xyzw: ArrayLike
    ) -> None:
        """Add the poses of `children` in `parent` at one time; `xyz` (n, 3) [m], `quat_xyzw` (n, 4)."""
        self._times += [time_ns] * len(children)
        self._rows.append((parent, children, xyz, quat_xyzw))


def _poses(rows: list[tuple[str, list[str], ArrayLike, ArrayLike]]) -> Iterable[rr.ComponentColumn]:
    _, children, xyz, quat_xyzw = zip(*rows, strict=True)
    return rr.Transform3D.columns(
        translation=np.concatenate(xyz, dtype=np.float32),
        quaternion=np.concatenate(quat_xyzw, dtype=np.float32),
        parent_frame=pa.array([parent for parent, names, *_ in rows for _ in names], pa.string()),
        child_frame=pa.array(list(chain.from_iterable(children)), pa.string()),
    )


class TrailColumns(Columns[Point, Point]):
    """A path travelled, one segment per row; the view shows every segment up to the cursor."""

    def __init__(self, entity: str, step_m: float) -> None:
        super().__init__(entity, _segments)
        self._step_m = step_m
        self._last: Point | None = None

    def visit(self, time_ns: int, *point: *Point) -> None:
        """Add a position [m]; ignored until it is a step away from the last one kept."""
        if self._last is None:
            self._last = point
        elif math.dist(point, self._last) >= self._step_m:
            self.append(time_ns, self._last, point)
            self._last = point


def _segments(rows: list[tuple[Point, Point]]) -> Iterable[rr.ComponentColumn]:
    return rr.LineStrips3D.columns(strips=np.array(rows, dtype=np.float32))
