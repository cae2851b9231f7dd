"""The triangles of one COLLADA `<geometry>`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from lxml import etree

from twin.geometry import Array
from twin.models.mesh.mesh_formats import Faces
from twin.models.urdf.document import Element


@dataclass(frozen=True, kw_only=True)
class Part:
    """Triangles of one material."""

    points: Array
    """Shape (n, 3), in the geometry's own unit and axes."""
    faces: Faces
    """Shape (m, 3)."""
    material: str
    """The symbol that an instance binds to a material."""


def read_geometry(geometry: Element, by_id: dict[str, Element]) -> Iterator[Part]:
    """Yield the parts of a `<geometry>`; lines are left out, other polygons become fans.

    Raises:
        ValueError: Something refers to what is not there.
    """
    for primitive in geometry.iterfind("{*}mesh/*"):
        if not isinstance(primitive.tag, str):
            continue
        read = _PRIMITIVES.get(etree.QName(primitive).localname)
        if read is None:
            continue
        offset, stride, points = _inputs(primitive, by_id)
        faces = read(primitive, offset, stride)
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(points):
            raise ValueError(f"has triangles between points 0 to {faces.max()}, of {len(points)}")
        yield Part(points=points, faces=faces, material=primitive.get("material", ""))


def _inputs(primitive: Element, by_id: dict[str, Element]) -> tuple[int, int, Array]:
    """Return where in a tuple of indices the point's stands, how long the tuple is, and the points."""
    offset, stride, points = None, 1, np.zeros((0, 3))
    for entry in primitive.iterfind("{*}input"):
        place = int(entry.get("offset", "0"))
        if not 0 <= place < 64:
            raise ValueError(f"has an input at offset {place}")
        stride = max(stride, place + 1)
        if entry.get("semantic") == "VERTEX":
            offset, points = place, _positions(_referred(entry, by_id), by_id)
    if offset is None:
        raise ValueError("has triangles without an input VERTEX")
    return offset, stride, points


def _referred(element: Element, by_id: dict[str, Element]) -> Element:
    target = by_id.get(element.get("source", "").removeprefix("#"))
    if target is None:
        raise ValueError(f"refers to '{element.get('source')}', which it does not hold")
    return target


def _positions(vertices: Element, by_id: dict[str, Element]) -> Array:
    for entry in vertices.iterfind("{*}input"):
        if entry.get("semantic") == "POSITION":
            return _source(_referred(entry, by_id), by_id)
    raise ValueError("has vertices without an input POSITION")


def _source(source: Element, by_id: dict[str, Element]) -> Array:
    accessor = source.find("{*}technique_common/{*}accessor")
    if accessor is None:
        raise ValueError("has points without an accessor")
    values = np.array((_referred(accessor, by_id).text or "").split(), dtype=np.float64)
    stride, offset = int(accessor.get("stride", "1")), int(accessor.get("offset", "0"))
    # A parameter without a name is skipped.
    named = [i for i, parameter in enumerate(accessor.iterfind("{*}param")) if parameter.get("name")]
    columns = named[:3] if len(named) >= 3 else [0, 1, 2]
    if stride <= max(columns) or offset < 0:
        raise ValueError(f"has points of {stride} coordinates")
    count = min(int(accessor.get("count", "0")), max(0, len(values) - offset) // stride)
    return values[offset : offset + max(0, count) * stride].reshape(-1, stride)[:, columns]


def _indices(element: Element | None, offset: int, stride: int) -> Faces:
    text = "" if element is None else element.text or ""
    values = np.array(text.split(), dtype=np.int64)
    if len(values) % stride:
        raise ValueError(f"has {len(values)} indices, no multiple of {stride}")
    return values[offset::stride]


def _fans(corners: Faces, counts: Faces) -> Faces:
    """Return polygons as fans of triangles; those of less than three corners have none."""
    if np.any(counts < 0) or np.any(counts > len(corners)) or counts.sum() != len(corners):
        raise ValueError(f"has polygons of {counts.sum()} corners in all, and indices for {len(corners)}")
    starts = np.cumsum(counts) - counts
    triangles = np.maximum(counts - 2, 0)
    first = np.repeat(starts, triangles)
    step = np.arange(len(first)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def _triangles(primitive: Element, offset: int, stride: int) -> Faces:
    corners = _indices(primitive.find("{*}p"), offset, stride)
    if len(corners) % 3:
        raise ValueError(f"has triangles of {len(corners)} corners in all")
    return corners.reshape(-1, 3)


def _polylist(primitive: Element, offset: int, stride: int) -> Faces:
    counts = np.array((primitive.findtext("{*}vcount") or "").split(), dtype=np.int64)
    return _fans(_indices(primitive.find("{*}p"), offset, stride), counts)


def _each(primitive: Element, offset: int, stride: int) -> list[Faces]:
    return [_indices(loop, offset, stride) for loop in primitive.iter("{*}p")]


def _polygons(primitive: Element, offset: int, stride: int) -> Faces:
    loops = [np.zeros(0, dtype=np.int64), *_each(primitive, offset, stride)]
    return _fans(np.concatenate(loops), np.array([len(loop) for loop in loops]))


def _strips(primitive: Element, offset: int, stride: int) -> Faces:
    faces = [np.zeros((0, 3), dtype=np.int64)]
    for strip in _each(primitive, offset, stride):
        if len(strip) >= 3:
            triangles = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)
            triangles[1::2] = triangles[1::2, ::-1]  # every other one is wound the other way
            faces.append(triangles)
    return np.concatenate(faces)


_PRIMITIVES = {
    "triangles": _triangles,
    "polylist": _polylist,
    "polygons": _polygons,
    "trifans": _polygons,
    "tristrips": _strips,
}
