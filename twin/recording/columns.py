"""Columns of Rerun's components, made of whole arrays.

Rerun's cost is per column, not per row: so rows wait for a block of time, and become Arrow arrays at once.
`columns` of Rerun's archetypes does the same at several times the cost of sending. Importing this module
imports rerun (0.4 s): only a run that records does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
import rerun.chunk as rc
from numpy.typing import ArrayLike, DTypeLike, NDArray

TIMELINE = "sim_time"
"""The one timeline: simulated time as a duration, from integer nanoseconds."""
_DURATION = pa.duration("ns")


class Times(NamedTuple):
    """The index of rows, as Rerun takes it."""

    array: pa.Array

    def timeline_name(self) -> str:
        """Return what the index is called."""
        return TIMELINE

    def as_arrow_array(self) -> pa.Array:
        """Return a duration for each row."""
        return self.array


class Column(NamedTuple):
    """One component of rows, as Rerun takes it."""

    descriptor: Any
    array: pa.Array

    def component_descriptor(self) -> Any:
        """Return the component's name, type and archetype."""
        return self.descriptor

    def as_arrow_array(self) -> pa.Array:
        """Return a list of instances for each row."""
        return self.array

    def row(self, index: int) -> Column:
        """Return one row as a column; they share memory."""
        return Column(self.descriptor, self.array.slice(index, 1))


Chunk = tuple[str, Times | None, Sequence[Column]]
"""Entity, index and columns; without an index they hold at all times."""


def send(recording: rr.RecordingStream, chunks: Iterable[Chunk]) -> None:
    """Send chunks, all at once: to wake up Rerun's threads for each would cost as much again."""
    recording.send_chunks(
        [
            # only the two methods of a `Column` are asked for
            rc.Chunk.from_columns(entity, () if times is None else (times,), columns)  # type: ignore[arg-type]
            for entity, times, columns in chunks
        ]
    )


def row_of(archetype: rr.AsComponents) -> list[Column]:
    """Return all that an archetype says as columns of one row."""
    batches = archetype.as_component_batches()
    values = [batch.as_arrow_array() for batch in batches]
    rows = [pa.ListArray.from_arrays([0, len(value)], value) for value in values]
    return [Column(batch.component_descriptor(), row) for batch, row in zip(batches, rows, strict=True)]


def sim_time(times_ns: ArrayLike) -> Times:
    """Return the index of rows at simulated times [ns], without rounding through seconds."""
    return Times(_numbers(times_ns, np.int64, _DURATION))


class Component:
    """One component of an archetype, as Rerun itself names and stores it."""

    def __init__(self, archetype: type[Any], name: str) -> None:
        """Look it up."""
        batches = archetype.from_fields(**{name: []}).as_component_batches()
        whole = f"{archetype.__name__}:{name}"
        (batch,) = (b for b in batches if b.component_descriptor().component == whole)
        self._descriptor = batch.component_descriptor()
        self._type = batch.as_arrow_array().type
        self._rows = pa.list_(self._type)

    def column(self, values: Any, lengths: ArrayLike | None = None) -> Column:
        """Return values as a column, by default one in a row.

        Args:
            values: One for each instance: texts, structures as dictionaries, or numbers, shape (n, ...); an
                instance that is a list of its own is an array in a list.
            lengths: How many instances each row has.
        """
        array = _arrow(values, self._type)
        n, offsets = (len(array), _one_each(len(array))) if lengths is None else _offsets(lengths)
        rows = pa.Array.from_buffers(self._rows, n, [None, offsets], children=[array])
        return Column(self._descriptor, rows)


component = cache(Component)
"""As `Component`, which is looked up once."""


def _arrow(values: Any, kind: pa.DataType) -> pa.Array:
    if pa.types.is_primitive(kind) and not pa.types.is_boolean(kind):  # which are bits
        return _numbers(values, kind.to_pandas_dtype(), kind)
    if pa.types.is_fixed_size_list(kind):
        items = _arrow(values, kind.value_type)
        return pa.Array.from_buffers(kind, len(items) // kind.list_size, [None], children=[items])
    if pa.types.is_list(kind):
        n, offsets = _offsets([len(value) for value in values])
        items = _arrow(np.concatenate(values) if n else (), kind.value_type)
        return pa.Array.from_buffers(kind, n, [None, offsets], children=[items])
    return pa.array(values, kind)


def _numbers(values: ArrayLike, dtype: DTypeLike, kind: pa.DataType) -> pa.Array:
    """Return numbers of any shape, one after another, in memory that Arrow owns.

    Rerun's threads let go of it: were it numpy's, each time they would have to wait for the run's thread.
    """
    values = np.asarray(values)
    buffer = pa.allocate_buffer(values.size * np.dtype(dtype).itemsize)
    np.frombuffer(buffer, dtype).reshape(values.shape)[...] = values
    return pa.Array.from_buffers(kind, values.size, [None, buffer])


def _offsets(lengths: ArrayLike) -> tuple[int, pa.Buffer]:
    """Return how many consecutive lists there are, and where each begins and the last one ends."""
    ends = np.cumsum(lengths, dtype=np.int32)
    buffer = pa.allocate_buffer(4 * (len(ends) + 1))
    offsets = np.frombuffer(buffer, np.int32)
    offsets[0], offsets[1:] = 0, ends
    return len(ends), buffer


@lru_cache(maxsize=256)
def _one_each(n: int) -> pa.Buffer:
    return _offsets(np.ones(n, dtype=np.int32))[1]


SCALARS = Component(rr.Scalars, "scalars")
STRIPS = Component(rr.LineStrips3D, "strips")
_TRANSLATION = Component(rr.Transform3D, "translation")
_QUATERNION = Component(rr.Transform3D, "quaternion")
_PARENT = Component(rr.Transform3D, "parent_frame")
_CHILD = Component(rr.Transform3D, "child_frame")


def scalars(times: Times, series: Mapping[str, ArrayLike]) -> Iterator[Chunk]:
    """Yield series of numbers by entity, all at the same times."""
    for entity, values in series.items():
        yield entity, times, (SCALARS.column(values),)


def transforms(
    entity: str,
    times: Times,
    parents: Sequence[str] | NDArray[np.object_],
    children: Sequence[str] | NDArray[np.object_],
    xyz: ArrayLike,
    quat_xyzw: ArrayLike,
) -> Chunk:
    """Return poses of named frames in their parents, one of each per row: shapes (n, 3) [m] and (n, 4)."""
    columns = (
        _TRANSLATION.column(xyz),
        _QUATERNION.column(quat_xyzw),
        _PARENT.column(parents),
        _CHILD.column(children),
    )
    return entity, times, columns
