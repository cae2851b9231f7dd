"""Reads a recording: for tests and tools, with nothing but rerun's chunk reader and pyarrow.

Works on the file of a killed run too, up to its last complete block.
"""

from __future__ import annotations

import hashlib
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray

from twin.errors import RecordingError, nearest
from twin.files.reading import open_file
from twin.recording.whole_messages import is_cut

if TYPE_CHECKING:
    import rerun.chunk as rc

MAGIC = (b"RRF2", b"RRIO")
"""First bytes of a Rerun recording."""

WATCH = "twin-watch"
"""Application of recordings of `twin watch`."""
_UNITS = (
    (r"/velocity/.*/linear/.*", "m/s"),
    (r"/velocity/.*/angular/.*", "rad/s"),
    (r"/localisation/.*/position_error", "m"),
    (r"/localisation/.*/yaw_error", "rad"),
    (r"/divergence/.*/position", "m"),
    (r"/divergence/.*/yaw", "rad"),
    (r".* Transform3D:translation", "m"),
)
"""Of numbers, by entity, or entity and component."""
_Part = tuple[NDArray[np.int64] | None, pa.Array]


@dataclass(frozen=True, kw_only=True)
class Column:
    """All values of one component of one entity, in the order of time, then of writing."""

    times_ns: NDArray[np.int64]
    """Shape (n,); empty for a static component."""
    array: pa.Array
    """Length n (1 if static), a list of instances per row."""

    @property
    def values(self) -> list[Any]:
        """The rows as Python objects."""
        return self.array.to_pylist()

    def numpy(self) -> NDArray[Any]:
        """Return the values as one array, shape (n, instances, ...), if all rows have the same size."""
        return np.array(self.values)


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A recording in memory."""

    application_id: str
    recording_id: str
    timelines: frozenset[str]
    columns: dict[str, dict[str, Column]] = field(repr=False)
    """By entity path and component, such as `Points3D:positions`."""

    @property
    def entities(self) -> tuple[str, ...]:
        """Paths, sorted."""
        return tuple(sorted(self.columns))

    def column(self, entity: str, component: str) -> Column:
        """Return one column.

        Raises:
            RecordingError: There is no such entity or component.
        """
        components = self._components_of(entity)
        if component not in components:
            raise RecordingError(f"no component {component!r} at {entity}; {nearest(component, components)}")
        return components[component]

    def table(self, entity: str) -> pa.Table:
        """Return what changes at an entity as an Arrow table, for `to_pandas()` and `polars.from_arrow`.

        Columns are `time`, simulated [s], and its components, as `scalars`; of those that are one number or
        vector at a time, the rows are that, others are lists. A unit that is known is
        `table.schema.field(name).metadata[b"unit"]`.

        Raises:
            RecordingError: There is no such entity, or nothing changes there, or not all of it at once.
        """
        self._components_of(entity)
        moving = {
            name: each
            for name, each in self.columns[entity].items()
            if len(each.times_ns) and name != "CoordinateFrame:frame"  # it is told when it changes
        }
        if not moving:
            raise RecordingError(f"nothing changes at {entity}; `column` has its components")
        times = next(iter(moving.values())).times_ns
        other = [name for name, each in moving.items() if not np.array_equal(each.times_ns, times)]
        if other:
            raise RecordingError(
                f"the components of {entity} have different times; `column` has each: {', '.join(moving)}"
            )
        arrays = [pa.array(times * 1e-9)]
        fields = [pa.field("time", pa.float64(), metadata={"unit": "s"})]
        for name, each in moving.items():
            array = each.array
            if (array.value_lengths().to_numpy(zero_copy_only=False) == 1).all():
                array = array.flatten()
            unit = _unit(entity, name)
            arrays.append(array)
            fields.append(
                pa.field(name.rpartition(":")[2], array.type, metadata={"unit": unit} if unit else None)
            )
        return pa.Table.from_arrays(arrays, schema=pa.schema(fields))

    def scalars(self, entity: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return times [ns], shape (n,), and the first number of each row, shape (n,)."""
        column = self.column(entity, "Scalars:scalars")
        return column.times_ns, np.array([row[0] for row in column.values], dtype=np.float64)

    def _components_of(self, entity: str) -> dict[str, Column]:
        if entity not in self.columns:
            raise RecordingError(f"no entity {entity!r} in the recording; {nearest(entity, self.columns)}")
        return self.columns[entity]


def check_recording(path: Path) -> Path:
    """Return `path` if it is the file of a recording.

    Raises:
        RecordingError: There is no such file, or it is something else.
    """
    try:
        with open_file(path) as file:
            magic = file.read(4)
    except OSError as error:
        raise RecordingError(
            f"{path}: cannot read the recording: {error.strerror}; `twin run` writes one as .rrd"
        ) from error
    if magic not in MAGIC:
        raise RecordingError(f"{path}: not a Rerun recording; valid: an .rrd file as `twin run` writes it")
    return path


def check_whole(path: Path) -> None:
    """See that a recording does not end within a message: for the rest of that one a viewer would wait.

    Raises:
        RecordingError: It does, or is none.
    """
    if is_cut(check_recording(path)):
        raise RecordingError(
            f"{path}: the recording is damaged: it ends within a message, as a copy does that was broken off"
        )


def shown_time_s(path: Path) -> float | None:
    """Return the time [s] that a picture of a recording shows by itself: a graph's end; None: a run's start.

    A graph that is watched shows what was said latest, and perhaps nothing at its start.

    Raises:
        RecordingError: See `read`.
    """
    reader = _reader(path)
    store = _stores(reader, path)[0]
    if store.application_id != WATCH:
        return None
    times = [
        moments
        for chunk in reader.stream(store=store)
        for _, moments, _ in _components(chunk.to_record_batch())
        if moments is not None and len(moments)
    ]
    return float(max((moments.max() for moments in times), default=0)) * 1e-9


def read(path: Path) -> Recording:
    """Read a recording.

    Raises:
        RecordingError: The file is missing, not a recording or empty.
    """
    reader = _reader(path)
    store = _stores(reader, path)[0]
    timelines: set[str] = set()
    parts: dict[tuple[str, str], list[_Part]] = {}
    for chunk in reader.stream(store=store):
        timelines.update(chunk.timeline_names)
        for name, times, array in _components(chunk.to_record_batch()):
            parts.setdefault((chunk.entity_path, name), []).append((times, array))
    columns: dict[str, dict[str, Column]] = {}
    for (entity, name), pieces in sorted(parts.items()):
        columns.setdefault(entity, {})[name] = _column(pieces)
    return Recording(
        application_id=store.application_id,
        recording_id=store.recording_id,
        timelines=frozenset(timelines),
        columns=columns,
    )


def has_video(path: Path) -> bool:
    """Tell whether any pictures of a recording are a video.

    Raises:
        RecordingError: See `read`.
    """
    reader = _reader(path)
    streams = (reader.stream(store=store) for store in _stores(reader, path))
    codecs = (stream.filter(is_static=True, components="VideoStream:codec") for stream in streams)
    return any(not chunk.is_empty for stream in codecs for chunk in stream)


def content_digest(path: Path) -> str:
    """Return a SHA-256 of what a recording says, whatever its chunks, ids and bytes are.

    Two runs of the same scenario have the same one. Left out: properties, which hold wall-clock times.

    Raises:
        RecordingError: See `read`.
    """
    digest = hashlib.sha256()
    recording = read(path)
    for entity in recording.entities:
        if entity.startswith("/__properties"):
            continue
        for component, column in sorted(recording.columns[entity].items()):
            digest.update(f"{entity}\0{component}\0".encode())
            digest.update(column.times_ns.tobytes())
            _hash_array(digest, column.array)
    return digest.hexdigest()


def _reader(path: Path) -> rc.RrdReader:
    import rerun.chunk as rc
    from rerun.error_utils import RerunWarning

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "RRD file has no footer", RerunWarning)  # it needs none
        return rc.RrdReader(check_recording(path))


def _stores(reader: rc.RrdReader, path: Path) -> list[Any]:
    try:
        stores = list(reader.recordings())
    except RuntimeError as fault:
        raise RecordingError(f"{path}: the recording is damaged: {fault}") from fault
    if not stores:
        raise RecordingError(f"{path}: holds no recording; the run ended before it wrote anything")
    return stores


def _unit(entity: str, component: str) -> str:
    names = entity, f"{entity} {component}"
    return next((unit for form, unit in _UNITS if any(re.fullmatch(form, name) for name in names)), "")


def _components(batch: pa.RecordBatch) -> Iterator[tuple[str, NDArray[np.int64] | None, pa.Array]]:
    """Yield name, times (None if static) and values of each component of a chunk, without empty rows."""
    index = next((i for i, item in enumerate(batch.schema) if _kind(item) == "index"), None)
    times = None if index is None else batch.column(index).cast(pa.int64()).to_numpy()
    for i, item in enumerate(batch.schema):
        if _kind(item) == "data":
            array = batch.column(i)
            valid = array.is_valid().to_numpy(zero_copy_only=False)
            name = (item.metadata or {}).get(b"rerun:component", item.name.encode()).decode()
            yield name, None if times is None else times[valid], array.drop_null()


def _kind(item: pa.Field) -> str:
    return (item.metadata or {}).get(b"rerun:kind", b"").decode()


def _column(parts: list[_Part]) -> Column:
    timed = [(times, array) for times, array in parts if times is not None]
    if not timed:
        return Column(times_ns=np.zeros(0, dtype=np.int64), array=parts[-1][1][-1:])
    times = np.concatenate([times for times, _ in timed])
    order = np.argsort(times, kind="stable")
    array = pa.concat_arrays([array for _, array in timed])
    return Column(times_ns=times[order], array=array.take(pa.array(order)))


def _hash_array(digest: hashlib._Hash, array: pa.Array) -> None:
    """Add an array's values, with the lengths of its lists, whatever buffers hold them."""
    kind = array.type
    digest.update(f"{len(array)}:".encode())
    if pa.types.is_list(kind) or pa.types.is_large_list(kind):
        digest.update(array.value_lengths().to_numpy(zero_copy_only=False).tobytes())
        _hash_array(digest, array.flatten())
    elif pa.types.is_fixed_size_list(kind):
        _hash_array(digest, array.flatten())
    elif (pa.types.is_integer(kind) or pa.types.is_floating(kind)) and array.null_count == 0:
        digest.update(np.ascontiguousarray(array.to_numpy(zero_copy_only=False)).tobytes())
    else:
        digest.update(repr(array.to_pylist()).encode())
