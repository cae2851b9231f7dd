"""STL, OBJ and MuJoCo's MSH: bytes to triangles, told apart by their content, not by the file's name.

Formats: STL as of 3D Systems (1989), Wavefront OBJ, MSH as in MuJoCo's XML reference (`asset/mesh/file`).
"""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array

Format = Literal["stl", "ascii-stl", "obj", "dae", "msh"]
Faces = NDArray[np.int64]
Rgb = tuple[float, float, float]

READABLE = "STL, OBJ and COLLADA (.dae)"
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_HEADER = 84
MOST_FACES = 360_000
MOST_POINTS = 3 * MOST_FACES
_SNIFFED = 4096
_BATCH = 10_000
_SHOWN = 60
_OTHERS = {
    b"glTF": "glTF, of which RViz and Gazebo disagree which axis is up",
    b"ply": "PLY",
    b"Kaydara FBX": "FBX",
    b"PK\x03\x04": "a zip archive",
    b"version https://git-lfs": "a Git LFS pointer: the mesh itself was not fetched",
}
_OTHER_SUFFIXES = {".mesh": "an Ogre mesh", ".gltf": _OTHERS[b"glTF"]}
# Blanks before a word may not reach over lines: every line would then be tried from every blank one above.
_VERTEX = re.compile(rb"^[ \t\r\f\v]*+vertex\s+(\S+)\s+(\S+)\s+(\S+)\s*$", re.IGNORECASE | re.MULTILINE)
_ENDFACET = re.compile(rb"\bendfacet\b", re.IGNORECASE)
_OBJ_POINT = re.compile(rb"^[ \t\r\f\v]*+v\s", re.MULTILINE)
_OBJ_LINE = re.compile(rb"^[ \t\f\v]*+([vf])(?!\S)([^\n]*)", re.MULTILINE)


@dataclass(frozen=True, kw_only=True, eq=False)
class TriangleMesh:
    """The surface in a mesh file."""

    points: Array
    """Shape (n, 3), in the file's axes [m, before the robot file's scale]; each is a corner of a triangle."""
    faces: Faces
    """Shape (m, 3), counter-clockwise seen from outside."""
    format: Format
    is_verbatim: bool = True
    """The file has no other points; MuJoCo would take them into the convex hull."""
    colour: Rgb | None = None
    """Of most of the triangles; only COLLADA files tell."""
    face_colours: Array | None = None
    """Of each triangle, shape (m, 3), not a number where it has none; only COLLADA files tell."""
    up_axis: str = "Z_UP"
    """What the file calls up; other axes are those of COLLADA files only."""


def format_of(data: bytes, suffix: str) -> Format:
    """Return the format of a mesh file.

    Args:
        data: All of the file.
        suffix: Of its name; it decides only where the content does not.

    Raises:
        ValueError: It is of none that is read.
    """
    start = data[:_SNIFFED].lstrip(b"\xef\xbb\xbf \t\r\n")
    if not start:
        raise ValueError("is empty")
    for magic, name in _OTHERS.items():
        if start.startswith(magic):
            raise ValueError(f"is {name}; {READABLE} are read")
    if start.startswith(b"<"):
        return "dae"
    if len(data) >= STL_HEADER and len(data) == STL_HEADER + _stl_count(data) * STL_TRIANGLE.itemsize:
        return "stl"
    if start[:5].lower() == b"solid" and b"\0" not in start:
        return "ascii-stl"
    if suffix == ".msh":
        return "msh"
    if suffix in _OTHER_SUFFIXES:
        raise ValueError(f"is {_OTHER_SUFFIXES[suffix]}; {READABLE} are read")
    if b"\0" not in start and _OBJ_POINT.search(data):
        return "obj"
    if suffix == ".stl":
        return "stl"
    raise ValueError(f"is no mesh of a known format; {READABLE} are read")


def _stl_count(data: bytes) -> int:
    return int.from_bytes(data[STL_HEADER - 4 : STL_HEADER], "little")


def read_stl(data: bytes) -> tuple[Array, Faces]:
    """Return the corners, shape (3 n, 3), and triangles of a binary STL file.

    Raises:
        ValueError: The file ends early.
    """
    count = _stl_count(data) if len(data) >= STL_HEADER else 0
    needed = STL_HEADER + count * STL_TRIANGLE.itemsize
    if len(data) < needed or not count:
        raise ValueError(
            f"is no whole STL file: its {len(data)} bytes tell of {count} triangles, which need {needed}"
        )
    triangles = np.frombuffer(data, STL_TRIANGLE, count, STL_HEADER)
    return _loose(triangles["corners"].astype(np.float64))


def read_ascii_stl(data: bytes) -> tuple[Array, Faces]:
    """Return the corners, shape (3 n, 3), and triangles of an ASCII STL file.

    Raises:
        ValueError: The file ends early or holds no numbers.
    """
    matches = _VERTEX.finditer(data)
    values = array("d")
    while batch := [float(word) for match in islice(matches, _BATCH) for word in match.groups()]:
        values.extend(batch)
        if len(values) > 3 * MOST_POINTS:
            raise too_many()
    facets = sum(1 for _ in islice(_ENDFACET.finditer(data), MOST_FACES + 1))
    whole = re.search(rb"\bendsolid\b", data[-_SNIFFED:], re.IGNORECASE)
    if not values or len(values) != 9 * facets or not whole:
        raise ValueError(f"is no whole STL file: {facets} complete triangles, {len(values) // 3} corners")
    return _loose(np.array(values))


def too_many() -> ValueError:
    """Return the fault of a file with more than is read."""
    return ValueError(f"has more than {MOST_FACES} triangles, or corners for more")


def _loose(corners: Array) -> tuple[Array, Faces]:
    corners = corners.reshape(-1, 3)
    return corners, np.arange(len(corners), dtype=np.int64).reshape(-1, 3)


def read_obj(data: bytes) -> tuple[Array, Faces]:
    """Return the points, shape (n, 3), and triangles of an OBJ file; polygons become fans.

    Raises:
        ValueError: A line is broken.
    """
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\\\n" in data:
        data = data.replace(b"\\\n", b" ")
    points, faces, polygons, largest = array("d"), array("q"), 0, 0
    for match in _OBJ_LINE.finditer(data):
        kind, rest = match.groups()
        try:
            if kind == b"v":
                x, y, z = rest.split(None, 3)[:3]
                points.extend((float(x), float(y), float(z)))
            else:
                polygons += 1
                words = rest.split(None, MOST_FACES + 2)
                largest = max(largest, len(words) - 2)
                first, *others = [_obj_index(word, len(points) // 3) for word in words[: MOST_FACES + 2]]
                for second, third in pairwise(others):
                    faces.extend((first, second, third))
        except ValueError:
            line = data.count(b"\n", 0, match.start()) + 1
            shown = match[0][: 4 * _SHOWN].decode(errors="replace").strip()[:_SHOWN]
            raise ValueError(f"has a broken line {line}: '{shown}'") from None
        if len(points) > 3 * MOST_POINTS or max(len(faces) // 3, polygons, largest) > MOST_FACES:
            raise too_many()
    return np.array(points).reshape(-1, 3), np.array(faces, dtype=np.int64).reshape(-1, 3)


def _obj_index(word: bytes, count: int) -> int:
    """Return the index from 0 of a corner as `3`, `3/1`, `3//2` or, counted from the end, `-1`."""
    index = int(word.partition(b"/")[0])
    if abs(index) > MOST_POINTS:
        raise ValueError(f"{index} is out of range")
    return index - 1 if index > 0 else count + index


def read_msh(data: bytes) -> tuple[Array, Faces]:
    """Return the points, shape (n, 3), and triangles of MuJoCo's own format.

    Raises:
        ValueError: The file has another size than its counts say.
    """
    counts = [int(value) for value in np.frombuffer(data[:16].ljust(16, b"\0"), "<i4")]
    points, normals, texcoords, faces = counts
    size = 16 + 12 * points + 12 * normals + 8 * texcoords + 12 * faces
    if min(counts) < 0 or len(data) != size:
        raise ValueError(f"is no whole MSH file: {len(data)} bytes, not {size}")
    corners = np.frombuffer(data, "<f4", 3 * points, 16).astype(np.float64).reshape(-1, 3)
    triangles = np.frombuffer(data, "<i4", 3 * faces, size - 12 * faces).astype(np.int64).reshape(-1, 3)
    return corners, triangles


def write_stl(points: Array, faces: Faces) -> bytes:
    """Return a binary STL file, without normals, which no simulator reads."""
    triangles = np.zeros(len(faces), STL_TRIANGLE)
    triangles["corners"] = points[faces]
    return bytes(STL_HEADER - 4) + len(faces).to_bytes(4, "little") + triangles.tobytes()


def write_msh(points: Array, faces: Faces) -> bytes:
    """Return a file of MuJoCo's own format, without normals and texture coordinates."""
    counts = np.array([len(points), 0, 0, len(faces)], "<i4")
    return counts.tobytes() + points.astype("<f4").tobytes() + faces.astype("<i4").tobytes()
