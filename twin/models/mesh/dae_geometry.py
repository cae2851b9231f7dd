"""The triangles of one COLLADA `<geometry>`, and what one file may ask for.

Without a bound, one of a megabyte can take hours and all memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from twin.geometry import Array
from twin.models.mesh.mesh_formats import MOST_FACES, Faces, too_many
from twin.models.urdf.document import Element

MOST_PIECES = 20_000
"""Nodes, transforms, instances and lists of triangles, as often as the scene goes through them."""
MOST_NUMBERS = 16_000_000
"""360 000 triangles with normals and colours have less."""
_CHUNK = 1 << 20


class Allowance:
    """Counts what is taken of both."""

    def __init__(self) -> None:
        self._pieces = MOST_PIECES
        self._numbers = MOST_NUMBERS

    def take_piece(self) -> None:
        """Take note of one more piece.

        Raises:
            ValueError: That is too many.
        """
        self._pieces -= 1
        if self._pieces < 0:
            raise ValueError(f"has a scene of more than {MOST_PIECES} nodes, transforms and instances in all")

    def numbers(self, text: str | None, kind: type[np.number[Any]]) -> NDArray[Any]:
        """Return the numbers of a text, shape (n,), of a type such as `np.float64`.

        Raises:
            ValueError: There is something else, or there are too many.
        """
        data = (text or "").encode()
        count = _words(data)
        self._numbers -= count
        if self._numbers < 0:
            raise ValueError(f"has more than {MOST_NUMBERS} numbers")
        if not count:
            return np.zeros(0, kind)
        values = np.fromstring(data, kind, sep=" ")  # unlike split(), this takes no memory for words
        if len(values) != count:
            raise ValueError("has something else among its numbers")
        return values


def _words(data: bytes) -> int:
    if len(data) < _CHUNK:
        return len(data.split())
    count, was_blank = 0, True
    for start in range(0, len(data), _CHUNK):
        blank = np.frombuffer(data, np.uint8, min(_CHUNK, len(data) - start), start) <= ord(" ")
        count += int(np.count_nonzero(blank[:-1] & ~blank[1:])) + int(was_blank and not blank[0])
        was_blank = bool(blank[-1])
    return count


@dataclass(frozen=True, kw_only=True)
class Part:
    """Triangles of one material."""

    points: Array
    """Shape (n, 3), in the geometry's own unit and axes."""
    faces: Faces
    """Shape (m, 3)."""
    material: str
    """The symbol that an instance binds to a material."""


class GeometryReader:
    """Reads the geometries of one file, everything in it once, however often it is referred to."""

    def __init__(self, by_id: dict[str, Element], allowance: Allowance) -> None:
        self._by_id = by_id
        self._allowance = allowance
        self._parts: dict[Element, tuple[Part, ...]] = {}
        self._positions: dict[Element, Array] = {}
        self._sources: dict[Element, Array] = {}

    def parts(self, geometry: Element) -> tuple[Part, ...]:
        """Return the parts of a `<geometry>`; lines are left out, other polygons become fans.

        Raises:
            ValueError: Something refers to what is not there, or there is more than is read.
        """
        if geometry not in self._parts:
            self._parts[geometry] = tuple(self._read(geometry))
        return self._parts[geometry]

    def _read(self, geometry: Element) -> Iterator[Part]:
        for primitive in geometry.iterfind("{*}mesh/*"):
            tag = etree.QName(primitive).localname if isinstance(primitive.tag, str) else ""
            read = _PRIMITIVES.get(tag)
            if read is None:
                continue
            self._allowance.take_piece()
            offset, stride, points = self._inputs(primitive)
            faces = read(primitive, offset, stride, self._allowance)
            if not len(faces):
                continue
            if not 0 <= faces.min() <= faces.max() < len(points):
                raise ValueError(f"has triangles between points 0 to {faces.max()}, of {len(points)}")
            used, faces = np.unique(faces, return_inverse=True)
            material = primitive.get("material", "")
            yield Part(points=points[used], faces=faces.reshape(-1, 3), material=material)

    def _inputs(self, primitive: Element) -> tuple[int, int, Array]:
        """Return where in a tuple of indices the point's stands, how long the tuple is, and the points."""
        offset, stride, points = None, 1, np.zeros((0, 3))
        for entry in primitive.iterfind("{*}input"):
            place = int(entry.get("offset", "0"))
            if not 0 <= place < 64:
                raise ValueError(f"has an input at offset {place}")
            stride = max(stride, place + 1)
            if entry.get("semantic") == "VERTEX":
                offset, points = place, self._vertices(_referred(entry, self._by_id))
        if offset is None:
            raise ValueError("has triangles without an input VERTEX")
        return offset, stride, points

    def _vertices(self, vertices: Element) -> Array:
        if vertices not in self._positions:
            position = vertices.find("{*}input[@semantic='POSITION']")
            if position is None:
                raise ValueError("has vertices without an input POSITION")
            source = _referred(position, self._by_id)
            if source not in self._sources:
                self._sources[source] = self._source(source)
            self._positions[vertices] = self._sources[source]
        return self._positions[vertices]

    def _source(self, source: Element) -> Array:
        accessor = source.find("{*}technique_common/{*}accessor")
        if accessor is None:
            raise ValueError("has points without an accessor")
        values = self._allowance.numbers(_referred(accessor, self._by_id).text, np.float64)
        stride, offset = int(accessor.get("stride", "1")), int(accessor.get("offset", "0"))
        # A parameter without a name is skipped.
        named = [i for i, parameter in enumerate(accessor.iterfind("{*}param")) if parameter.get("name")]
        columns = named[:3] if len(named) >= 3 else [0, 1, 2]
        if stride <= max(columns) or offset < 0:
            raise ValueError(f"has points of {stride} coordinates")
        count = min(int(accessor.get("count", "0")), max(0, len(values) - offset) // stride)
        if count <= 0:
            return np.zeros((0, 3))
        return values[offset : offset + count * stride].reshape(-1, stride)[:, columns]


def _referred(element: Element, by_id: dict[str, Element]) -> Element:
    target = by_id.get(element.get("source", "").removeprefix("#"))
    if target is None:
        raise ValueError(f"refers to '{element.get('source')}', which it does not hold")
    return target


def _indices(element: Element | None, offset: int, stride: int, allowance: Allowance) -> Faces:
    values = allowance.numbers(None if element is None else element.text, np.int64)
    if len(values) % stride:
        raise ValueError(f"has {len(values)} indices, no multiple of {stride}")
    return values[offset::stride]


def _loops(primitive: Element, offset: int, stride: int, allowance: Allowance) -> tuple[Faces, Faces]:
    """Return the corners of all `<p>` one after the other, and how many each has."""
    loops = [_indices(loop, offset, stride, allowance) for loop in primitive.iter("{*}p")]
    return np.concatenate([np.zeros(0, np.int64), *loops]), np.array(list(map(len, loops)), dtype=np.int64)


def _runs(counts: Faces) -> tuple[Faces, Faces]:
    """Return for each triangle of polygons or strips, one after the other, start and its number there."""
    triangles = np.maximum(counts - 2, 0)
    if len(counts) > MOST_FACES or triangles.sum() > MOST_FACES:
        raise too_many()
    first = np.repeat(np.cumsum(counts) - counts, triangles)
    return first, np.arange(len(first)) - np.repeat(np.cumsum(triangles) - triangles, triangles)


def _fans(corners: Faces, counts: Faces) -> Faces:
    """Return polygons as fans of triangles; those of less than three corners have none."""
    if np.any(counts < 0) or np.any(counts > len(corners)) or counts.sum() != len(corners):
        raise ValueError(f"has polygons of {counts.sum()} corners in all, and indices for {len(corners)}")
    first, step = _runs(counts)
    return corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def _triangles(primitive: Element, offset: int, stride: int, allowance: Allowance) -> Faces:
    corners = _indices(primitive.find("{*}p"), offset, stride, allowance)
    if len(corners) % 3:
        raise ValueError(f"has triangles of {len(corners)} corners in all")
    if len(corners) > 3 * MOST_FACES:
        raise too_many()
    return corners.reshape(-1, 3)


def _polylist(primitive: Element, offset: int, stride: int, allowance: Allowance) -> Faces:
    counts = allowance.numbers(primitive.findtext("{*}vcount"), np.int64)
    return _fans(_indices(primitive.find("{*}p"), offset, stride, allowance), counts)


def _polygons(primitive: Element, offset: int, stride: int, allowance: Allowance) -> Faces:
    return _fans(*_loops(primitive, offset, stride, allowance))


def _strips(primitive: Element, offset: int, stride: int, allowance: Allowance) -> Faces:
    corners, counts = _loops(primitive, offset, stride, allowance)
    first, step = _runs(counts)
    faces = corners[np.stack([first + step, first + step + 1, first + step + 2], axis=1)]
    faces[step % 2 == 1] = faces[step % 2 == 1, ::-1]  # every other one is wound the other way
    return faces


_PRIMITIVES = {
    "triangles": _triangles,
    "polylist": _polylist,
    "polygons": _polygons,
    "trifans": _polygons,
    "tristrips": _strips,
}
