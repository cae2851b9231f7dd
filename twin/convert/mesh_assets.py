"""Mesh files as what MuJoCo reads: binary STL, OBJ and MSH mostly stay, others become binary STL."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from twin.files.reading import read_bytes
from twin.models.mesh.mesh_formats import TriangleMesh, write_msh, write_stl
from twin.models.mesh.meshes import read_mesh
from twin.models.shapes import Mesh

MOST_STL_FACES = 200_000
"""MuJoCo reads no STL file with more (its stl_decoder); its own format, MSH, has no such limit."""
MOST_FACE_BYTES = 1000
"""Of a triangle, on average, in a file that stays as it is; an OBJ file may hold anything beside them."""
MOST_KEPT = 10 * 1024 * 1024
"""Bytes of a file that stays as it is; MuJoCo takes many times as much to read an OBJ file."""
_KEPT = {"stl": ".stl", "obj": ".obj", "msh": ".msh"}


def mesh_asset(mesh: Mesh) -> tuple[str, bytes]:
    """Return a name made of the content, and the content, the same bytes each time.

    Raises:
        ModelError: As by `read_mesh`.
    """
    triangles = read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis)
    suffix, content = _content(mesh.path, triangles)
    return f"{plain_stem(mesh.path)}-{hashlib.sha256(content).hexdigest()[:8]}{suffix}", content


def plain_stem(path: Path) -> str:
    """Return a file's name without suffix, with `_` for line breaks and the like: XML changes them."""
    return "".join(char if char.isprintable() else "_" for char in path.stem)


@lru_cache(maxsize=128)
def _content(path: Path, triangles: TriangleMesh) -> tuple[str, bytes]:
    few = len(triangles.faces) <= MOST_STL_FACES
    lean = path.stat().st_size <= min(MOST_KEPT, MOST_FACE_BYTES * (len(triangles.faces) + 4))
    if triangles.format in _KEPT and triangles.is_verbatim and lean and (few or triangles.format != "stl"):
        return _KEPT[triangles.format], read_bytes(path)
    if few:
        return ".stl", write_stl(triangles.points, triangles.faces)
    return ".msh", write_msh(triangles.points, triangles.faces)
