"""Small mesh files that would take hours, or all memory, if reading took more than in proportion to them."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from tests.models.mesh.test_meshes import OBJ, POINTS, TRIANGLES, ascii_stl, dae, read
from tests.oracles.mesh_fuzz import hostile, run
from twin.errors import ModelError
from twin.models.mesh.hulls import hull_of
from twin.models.mesh.mesh_formats import write_msh
from twin.models.mesh.meshes import MOST_BYTES, read_mesh
from twin.models.shapes import Mesh

pytestmark = pytest.mark.timeout(30)
FLOOD = 200_000
MANY = "<node><instance_geometry url='#g'/></node>" * 3000


def with_unused_numbers(content: bytes, count: int) -> bytes:
    return content.replace(b"</float_array>", b" 0" * count + b"</float_array>").replace(
        b'count="4" stride', b'count="%d" stride' % (len(POINTS) + count // 3)
    )


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.obj", b"#" + b"\n" * FLOOD),
        ("m.obj", b"#" + b" \n" * FLOOD),
        ("m.stl", b"solid\n" + b"\n" * FLOOD + ascii_stl()[20:]),
        ("m.stl", ascii_stl() + b"\n" * FLOOD),
        ("m.stl", ascii_stl()[:-9] + b"\n" * FLOOD),
    ],
    ids=["no points", "blanks", "before", "after", "no end"],
)
def test_a_flood_is_read_or_refused(tmp_path: Path, name: str, content: bytes) -> None:
    try:
        mesh = read(tmp_path, content, name)
    except ModelError:
        return
    assert len(mesh.points) == 3 * len(POINTS)


def test_numbers_that_many_instances_share_are_read_once(tmp_path: Path) -> None:
    mesh = read(tmp_path, with_unused_numbers(dae(MANY), 90_000))
    assert len(mesh.points) == 3000 * len(POINTS)


@pytest.mark.parametrize(
    "content",
    [
        dae("<node id='n0'>" + "<instance_geometry url='#g'/>" * 201 + "</node>"),
        dae("<node>" + "<scale>1 1 1</scale>" * 201 + "<instance_geometry url='#g'/></node>"),
        dae("<node><instance_geometry url='#g'/></node>" * 50, primitives=TRIANGLES * 4),
    ],
    ids=["instances", "transforms", "primitives"],
)
def test_a_scene_has_a_limit_of_pieces_which_the_error_tells(
    tmp_path: Path, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("twin.models.mesh.dae_geometry.MOST_PIECES", 200)
    with pytest.raises(ModelError, match="more than 200 nodes, transforms and instances"):
        read(tmp_path, content)


@pytest.mark.parametrize(("tag", "noun"), [("<a/>", "tags"), ("<?a b='' c=''?>", "attributes")])
def test_a_collada_file_has_a_limit_of_tags(tmp_path: Path, tag: str, noun: str) -> None:
    with pytest.raises(ModelError, match=f"more than 300000 {noun}"):
        read(tmp_path, dae(primitives=TRIANGLES + tag * (300_001 if noun == "tags" else 150_001)))


def test_very_many_ids_are_found_soon(tmp_path: Path) -> None:
    ids = "".join(f"<a id='i{i}'/>" for i in range(80_000))
    assert len(read(tmp_path, dae(primitives=ids + TRIANGLES)).points) == len(POINTS)


def test_a_polygon_of_more_corners_than_are_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="more than 360000 triangles"):
        read(tmp_path, OBJ.encode() + b"f" + b" 1" * 360_003, "m.obj")


def test_blanks_take_no_more_memory_than_a_few_times_the_file(tmp_path: Path) -> None:
    content = OBJ.encode() + b" \n" * 2_000_000
    tracemalloc.start()
    try:
        read(tmp_path, content, "m.obj")
        assert tracemalloc.get_traced_memory()[1] < 4 * len(content)
    finally:
        tracemalloc.stop()


def test_one_long_number_does_not_make_all_others_as_long(tmp_path: Path) -> None:
    mesh = read(tmp_path, OBJ.replace("v 0.0 0.0 0.0", f"v 0.{'0' * 1_000_000} 0 0").encode() * 5, "m.obj")
    assert len(mesh.points) == len(POINTS)


def test_a_file_of_more_bytes_than_are_read_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "m.obj").open("wb") as stream:
        stream.truncate(MOST_BYTES + 1)
    with pytest.raises(ModelError, match="at most 50331648 are read"):
        read_mesh(tmp_path / "m.obj")


def test_a_fault_is_found_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(2):
        with pytest.raises(ModelError, match="no mesh of a known format"):
            read_mesh(tmp_path / "m.obj") if (tmp_path / "m.obj").exists() else read(
                tmp_path, b"no mesh", "m.obj"
            )
        monkeypatch.setattr("twin.models.mesh.meshes.read_bytes", None)


def test_equal_points_are_joined_where_there_are_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("twin.models.mesh.meshes.MOST_DIFFERENT", 4)
    mesh = read(tmp_path, ascii_stl(), "m.stl")
    assert len(mesh.points) == len(POINTS)
    assert not mesh.is_verbatim
    monkeypatch.setattr("twin.models.mesh.meshes.MOST_DIFFERENT", 3)
    with pytest.raises(ModelError, match="has 4 different points; at most 3 are read"):
        read(tmp_path, ascii_stl(), "n.stl")


def test_indices_for_too_many_triangles_are_not_gone_through(tmp_path: Path) -> None:
    content = dae(primitives=TRIANGLES[: TRIANGLES.index("<p>") + 3] + "1 " * 1_200_000 + "</p></triangles>")
    tracemalloc.start()
    try:
        with pytest.raises(ModelError, match="more than 360000 triangles"):
            read(tmp_path, content)
        assert tracemalloc.get_traced_memory()[1] < 12 * len(content)
    finally:
        tracemalloc.stop()


def test_a_cylinder_of_very_many_corners_has_its_hull_soon(tmp_path: Path) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 10_000, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    points, start = np.concatenate([ring, ring + np.array([0.0, 0.0, 1.0])]), np.arange(19_998)
    (tmp_path / "m.msh").write_bytes(write_msh(points, np.stack([start, start + 1, start + 2], axis=1)))
    hull = hull_of(Mesh(path=tmp_path / "m.msh"))
    assert hull is not None
    assert hull.volume == pytest.approx(np.pi, rel=1e-6)


@pytest.mark.timeout(120)
def test_a_slice_of_the_fuzz_run_is_endured() -> None:
    outcomes, _, _ = run(range(20))
    assert outcomes["accepted"] >= 3


def test_a_seed_is_always_the_same_file() -> None:
    assert [hostile(seed) for seed in range(10)] == [hostile(seed) for seed in range(10)]
