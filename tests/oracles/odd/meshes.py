"""Mesh files that are none, too large, or somewhere else."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from tests.oracles.odd.case import INERTIAL, Case, Content, Model, accepted, link, refused, robot, shaped
from twin.models.mesh.mesh_formats import write_stl

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
STL = write_stl(CORNERS, FACES)
FLAT = CORNERS * [1, 1, 0] + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 1, 0]]
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def _ball(faces: int) -> bytes:
    """Return triangles whose every corner is a corner of the hull: the worst case for finding it."""
    index = np.arange(3 * faces) + 0.5
    polar, turn = np.arccos(1 - 2 * index / (3 * faces)), np.pi * (1 + 5**0.5) * index
    points = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=-1)
    return write_stl(points, np.arange(3 * faces).reshape(-1, 3))


def _mesh(name: str = "m.stl", scale: str = "1 1 1") -> str:
    return f"<mesh filename='{name}' scale='{scale}'/>"


def _bad(
    content: Content, *says: str, name: str = "m.stl", scale: str = "1 1 1", role: str = "collision"
) -> Case:
    return refused(shaped(_mesh(name, scale), role), *says, files={name: content})


def _elsewhere(path: Path) -> None:
    path.symlink_to("/etc/passwd")


def _itself(path: Path) -> None:
    path.symlink_to(path.name)


def _one_mesh(model: Model) -> bool:
    return model.nmesh == 1 and model.mesh_vertnum[0] >= 4


REFERENCES = {
    "../m.stl": "does not exist",
    "../../../../../../etc/passwd": "is outside of the file's folder",
    "/etc/passwd": "is outside of the file's folder",
    "file:///etc/passwd": "is outside of the file's folder",
    "http://127.0.0.1:9/m.stl": "is no local file",
    "package://nope/m.stl": "no package 'nope'",
    "package://../m.stl": "no package '..'",
    "": "has no filename=",
    "a&#0;b": "invalid character number",
    "x" * 5000: "is no name of a file",
}
MESHES = {
    **{f"mesh '{name[:30]}'": refused(shaped(_mesh(name)), says) for name, says in REFERENCES.items()},
    "mesh is a folder": _bad(Path.mkdir, "does not exist"),
    "mesh is a pipe": _bad(os.mkfifo, "does not exist"),
    "mesh is a link out": _bad(_elsewhere, "is outside of the file's folder"),
    "mesh is a link to itself": _bad(_itself, "does not exist"),
    "empty STL": _bad(b"", "is empty"),
    "STL of no faces": _bad(write_stl(CORNERS, FACES[:0]), "tell of 0 triangles"),
    "STL of one face": _bad(write_stl(CORNERS, FACES[:1]), "less than four different points"),
    "STL of NaN": _bad(STL[:100] + b"\xff" * 12 + STL[112:], "not finite"),
    "STL that ends early": _bad(STL[:-1], "is no whole STL file"),
    "STL of four milliard faces": _bad(STL[:80] + b"\xff" * 4 + STL[84:], "4294967295 triangles"),
    "STL that is flat": _bad(write_stl(FLAT, FACES), "is flat"),
    "a good STL": accepted(shaped(_mesh()), _one_mesh, files={"m.stl": STL}),
    "ball of 300000 faces": _bad(_ball(300_000), "900000 different points; at most 200000"),
    "ball of 60000 faces": accepted(shaped(_mesh()), _one_mesh, files={"m.stl": _ball(60_000)}),
    "two million faces": _bad(OBJ + b"f 1 2 3\n" * 2_000_000, "has more than 360000 triangles", name="m.obj"),
    "mirrored": accepted(shaped(_mesh(scale="-1 1 1")), _one_mesh, files={"m.stl": STL}),
    "scale of zero": _bad(STL, "has a scale of zero", scale="0 1 1"),
    "scale of NaN": _bad(STL, "is not finite", scale="nan 1 1"),
    "scale of one number": _bad(STL, "has 1 numbers, not 3", scale="2"),
    "scale beyond all bounds": _bad(STL, "reaches", scale="1e10 1 1"),
    "scaled to dust": _bad(STL, "mesh surface area is too small", scale="1e-8 1e-8 1e-8"),
    "OBJ of lines": _bad(b"l 1 2\n" * 1_000_000, "no mesh of a known format", name="m.obj"),
    "OBJ of huge indices": _bad(OBJ + b"f 1 2 99999999999999999999\n", "has a broken line 5", name="m.obj"),
    "OBJ of no such corner": _bad(OBJ + b"f 1 2 9\n", "points that it does not have", name="m.obj"),
    "OBJ of spaces": _bad(b" " * 300_000 + b"\n" * 300_000, "is empty", name="m.obj"),
    "COLLADA with entities": _bad(
        b"<!DOCTYPE x [<!ENTITY a 'a'>]><COLLADA>&a;</COLLADA>", "DOCTYPE", name="m.dae"
    ),
    "COLLADA of nothing": _bad(b"<COLLADA/>", "has no scene", name="m.dae"),
    "COLLADA that is deep": _bad(b"<a>" * 100_000 + b"</a>" * 100_000, "not well-formed", name="m.dae"),
    "a picture": _bad(b"\x89PNG\r\n\x1a\n" + bytes(100), "is no whole STL file"),
    "a pointer of Git LFS": _bad(
        b"version https://git-lfs.github.com/spec/v1\n", "the mesh itself was not fetched"
    ),
    "bad mesh, left out": accepted(
        shaped(_mesh()),
        lambda m: m.ngeom == 0,
        "skipped-mesh",
        files={"m.stl": b""},
        options=("--missing-mesh", "skip"),
    ),
    "line break in a mesh's name": accepted(shaped(_mesh("a&#10;b.stl")), _one_mesh, files={"a\nb.stl": STL}),
    "odd name of a mesh": accepted(shaped(_mesh("ä 🤖 &quot;#.stl")), _one_mesh, files={'ä 🤖 "#.stl': STL}),
    "one mesh under two names": accepted(
        robot(
            link(
                "a",
                INERTIAL
                + "".join(
                    f"<collision><geometry>{_mesh(f)}</geometry></collision>" for f in ("x/m.stl", "y/m.stl")
                ),
            )
        ),
        lambda m: m.nmesh == 2,
        files={"x/m.stl": STL, "y/m.stl": STL},
    ),
}
"""What is odd about the mesh, and the outcome."""
