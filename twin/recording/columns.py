"""Columns of Rerun's components, made of whole arrays.

Rerun's cost is per column, not per row: so rows wait for a block of simulated time, and become Arrow arrays
at once. `columns` of Rerun's archetypes does the same at twice the cost of sending. Importing this module
imports rerun (0.4 s): only a run that records does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
from numpy.typing import ArrayLike, NDArray

TIMELINE = "sim_time"
"""The one timeline: simulated time as a duration, from integer nanoseconds."""

Chunk = tuple[str, list[rr.TimeColumn], list[rr.ComponentColumn]]
"""Entity, index and columns: what `rr.send_columns` takes."""


def sim_time(times_ns: ArrayLike) -> list[rr.TimeColumn]:
    """Return the index of rows at simulated times [ns], without rounding through seconds."""
    return [rr.TimeColumn(TIMELINE, duration=np.array(times_ns, dtype="timedelta64[ns]"))]


class Component:
    """One component of an archetype, as Rerun itself names and stores it."""

    def __init__(self, archetype: type[Any], name: str) -> None:
        """Look it up."""
        batches = archetype.from_fields(**{name: []}).as_component_batches()
        whole = f"{archetype.__name__}:{name}"
        (batch,) = (b for b in batches if b.component_descriptor().component == whole)
        self._descriptor = batch.component_descriptor()
        self._type = batch.as_arrow_array().type

    def column(self, values: Any, lengths: ArrayLike | None = None) -> rr.ComponentColumn:
        """Return values as a column, by default one in a row.

        Args:
            values: One for each instance: texts, or numbers, shape (n, ...); an instance that is a list of
                its own is an array in a list.
            lengths: How many instances each row has.
        """
        array = _arrow(values, self._type)
        offsets = np.arange(len(array) + 1, dtype=np.int32) if lengths is None else _offsets(lengths)
        return rr.ComponentColumn(self._descriptor, _Batch(array), offsets=offsets)


class _Batch(NamedTuple):
    array: pa.Array

    def as_arrow_array(self) -> pa.Array:
        return self.array


def _arrow(values: Any, kind: pa.DataType) -> pa.Array:
    if pa.types.is_fixed_size_list(kind):
        flat = np.asarray(values, dtype=kind.value_type.to_pandas_dtype()).ravel()
        return pa.FixedSizeListArray.from_arrays(pa.array(flat), type=kind)
    if pa.types.is_list(kind):
        items = _arrow(np.concatenate(values), kind.value_type)
        return pa.ListArray.from_arrays(_offsets([len(value) for value in values]), items, type=kind)
    return pa.array(values, kind)


def _offsets(lengths: ArrayLike) -> NDArray[np.int32]:
    """Return where each of consecutive lists begins, and where the last one ends."""
    sums = np.cumsum(lengths, dtype=np.int32)
    return np.concatenate((np.zeros(1, dtype=np.int32), sums))


SCALARS = Component(rr.Scalars, "scalars")
STRIPS = Component(rr.LineStrips3D, "strips")
_TRANSLATION = Component(rr.Transform3D, "translation")
_QUATERNION = Component(rr.Transform3D, "quaternion")
_PARENT = Component(rr.Transform3D, "parent_frame")
_CHILD = Component(rr.Transform3D, "child_frame")


def scalars(index: list[rr.TimeColumn], series: Mapping[str, ArrayLike]) -> Iterator[Chunk]:
    """Yield series of numbers by entity, all at the same times."""
    for entity, values in series.items():
        yield entity, index, [SCALARS.column(np.asarray(values, dtype=np.float64))]


def transforms(
    entity: str,
    index: list[rr.TimeColumn],
    parents: Sequence[str] | NDArray[np.object_],
    children: Sequence[str] | NDArray[np.object_],
    xyz: ArrayLike,
    quat_xyzw: ArrayLike,
) -> Chunk:
    """Return poses of named frames in their parents, one of each per row: shapes (n, 3) [m] and (n, 4)."""
    columns = [
        _TRANSLATION.column(xyz),
        _QUATERNION.column(quat_xyzw),
        _PARENT.column(parents),
        _CHILD.column(children),
    ]
    return entity, index, columns
