"""Mesh files as triangles, whatever their format, and what is wrong with them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from twin.errors import ModelError, Problem
from twin.files.reading import read_bytes
from twin.geometry import Array
from twin.models.description import RobotDescription
from twin.models.mesh.dae import read_dae
from twin.models.mesh.mesh_formats import (
    MOST_FACES,
    Faces,
    Format,
    TriangleMesh,
    format_of,
    read_ascii_stl,
    read_msh,
    read_obj,
    read_stl,
)
from twin.models.shapes import Collision, Mesh
from twin.models.urdf.xml_text import as_utf8

MOST_BYTES = 48 * 1024 * 1024
"""360 000 triangles as binary STL have 18 MB."""
MOST_DIFFERENT = 200_000
"""Points after equal ones are joined; a closed surface has half as many as triangles."""
LONGEST_FAULT = 200
"""Characters of what is wrong with a file: it may quote the file."""
FARTHEST = 1e6
"""Largest coordinate [m], in the file and scaled; MuJoCo keeps meshes in single precision."""
_MIX = 0x9E3779B97F4A7C15
"""2^64 over the golden ratio: multiples of it spread well."""
FLAT = 1e-6
"""Thickness, relative to its size, up to which a mesh has no volume."""


def read_mesh(path: Path, *, apply_up_axis: bool = True) -> TriangleMesh:
    """Return the triangles of an STL, OBJ, COLLADA or MSH file; the same object while the file is the same.

    Args:
        path: The file; its content decides on the format.
        apply_up_axis: For COLLADA, see `twin.models.mesh.dae.read_dae`.

    Raises:
        ModelError: It cannot be read (code `mesh-format`) or holds no usable mesh (code `bad-mesh`).
    """
    try:
        status = path.stat()
    except OSError as error:
        raise _fault(path, f"cannot be read: {error.strerror}", code="mesh-format") from None
    if status.st_size > MOST_BYTES:
        raise _fault(path, f"has {status.st_size} bytes; at most {MOST_BYTES} are read", code="bad-mesh")
    found = _read(path, apply_up_axis, status.st_mtime_ns, status.st_size)
    if isinstance(found, ModelError):
        raise ModelError(found.problems)
    return found


def _fault(path: Path, message: str, *, code: str) -> ModelError:
    return ModelError(Problem(message, path, code=code))


@lru_cache(maxsize=128)
def _read(path: Path, apply_up_axis: bool, _changed_ns: int, _size: int) -> TriangleMesh | ModelError:
    """Return the mesh, or what is wrong with it: a cache keeps no exceptions, and a robot asks often."""
    try:
        return _read_now(path, apply_up_axis)
    except ModelError as fault:
        return ModelError(fault.problems)


def _read_now(path: Path, apply_up_axis: bool) -> TriangleMesh:
    try:
        data = read_bytes(path, MOST_BYTES)
        kind = format_of(data, path.suffix.lower())
        with np.errstate(over="ignore", invalid="ignore"):
            read = _parse(as_utf8(data, path) if kind == "dae" else data, kind, apply_up_axis)
    except OSError as error:
        raise _fault(path, f"cannot be read: {error.strerror}", code="mesh-format") from None
    except (ValueError, OverflowError, RecursionError, MemoryError) as error:
        said = " ".join(str(error)[: 2 * LONGEST_FAULT].split()) or "is too complex"
        shown = said if len(said) <= LONGEST_FAULT else f"{said[:LONGEST_FAULT]}…"
        raise _fault(path, shown, code="mesh-format") from None
    flaw = _flaw(read.points, read.faces)
    if flaw:
        raise _fault(path, flaw, code="bad-mesh")
    used, faces = np.unique(read.faces, return_inverse=True)
    points, faces = read.points[used], faces.reshape(-1, 3)
    is_verbatim = len(used) == len(read.points)
    if len(points) > MOST_DIFFERENT:
        points, faces, is_verbatim = *_joined(points, faces), False
        if len(points) > MOST_DIFFERENT:
            message = f"has {len(points)} different points; at most {MOST_DIFFERENT} are read"
            raise _fault(path, message, code="bad-mesh")
    points.flags.writeable = faces.flags.writeable = False  # it is shared
    return replace(read, points=points, faces=faces, is_verbatim=is_verbatim)


def _parse(data: bytes, kind: Format, apply_up_axis: bool) -> TriangleMesh:
    if kind == "dae":
        return read_dae(data, apply_up_axis=apply_up_axis)
    readers = {"stl": read_stl, "ascii-stl": read_ascii_stl, "obj": read_obj, "msh": read_msh}
    points, faces = readers[kind](data)
    return TriangleMesh(points=points, faces=faces, format=kind)


def _flaw(points: Array, faces: Faces) -> str | None:
    if not len(faces):
        return "has no triangles"
    if len(faces) > MOST_FACES:
        return f"has {len(faces)} triangles; at most {MOST_FACES} are read"
    if faces.min() < 0 or faces.max() >= len(points):
        return f"has a triangle between points that it does not have; there are {len(points)}"
    used = points[faces.ravel()]
    if not np.all(np.isfinite(used)):
        return "has points that are not finite"
    largest = float(np.max(np.abs(used)))
    if largest > FARTHEST:
        return f"reaches {largest:.3g} m far; at most {FARTHEST:g} m are read"
    if _are_few(used[:64]) and _are_few(used):  # four different points are mostly among the first ones
        return "has less than four different points"
    return None


def _joined(points: Array, faces: Faces) -> tuple[Array, Faces]:
    """Return the mesh with equal points as one; all of them if that is not sure."""
    bits = (points + 0.0).view(np.uint64)  # adding makes -0 a 0
    mixed = (bits ^ (bits >> np.uint64(29))) @ np.array([_MIX, _MIX**3 % 2**64, _MIX**5 % 2**64], np.uint64)
    _, first, which = np.unique(mixed, return_index=True, return_inverse=True)
    if not np.array_equal(points[first][which], points):
        return points, faces
    return points[first], which[faces]


def _are_few(points: Array) -> bool:
    others = points.astype(np.float32)
    for _ in range(3):
        others = others[np.any(others != others[:1], axis=1)]
    return not len(others)


def mesh_faults(description: RobotDescription, *, visuals: bool = True) -> tuple[Problem, ...]:
    """Return what keeps the robot's meshes from being used, in file order; reads them all.

    Args:
        description: The robot.
        visuals: Also look at the meshes that are seen only.
    """
    faults: dict[Problem, None] = {}
    for name, link in description.links.items():
        for shape in link.shapes if visuals else link.collisions:
            mesh = shape.geometry
            if isinstance(mesh, Mesh) and (fault := _fault_of(mesh, isinstance(shape, Collision))):
                message = f"mesh '{mesh.path.name}' of link '{name}' {fault[0]}"
                line, element = shape.line or None, f"link '{name}'"
                faults[Problem(message, description.source, line, code=fault[1], element=element)] = None
    return tuple(faults)


def _fault_of(mesh: Mesh, touched: bool) -> tuple[str, str] | None:
    """Return what is wrong with a mesh, and its code."""
    try:
        points = scaled_points(mesh)
    except ModelError as error:
        return error.problems[0].message, error.problems[0].code
    if touched and is_flat(points):
        return "is flat, and a thing to touch needs a volume; use a thin <box>", "bad-mesh"
    return None


def scaled_points(mesh: Mesh) -> Array:
    """Return the corners of a mesh in its own frame [m], shape (n, 3).

    Raises:
        ModelError: As by `read_mesh`.
    """
    points = read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis).points * mesh.scale
    largest = float(np.max(np.abs(points)))
    if largest > FARTHEST:
        raise _fault(mesh.path, f"reaches {largest:.3g} m far with its scale", code="bad-mesh")
    return points


def is_flat(points: Array) -> bool:
    """Tell whether all points, shape (n, 3), lie in a plane."""
    thickness = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(thickness[2] <= FLAT * thickness[0])
