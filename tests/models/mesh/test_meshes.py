"""Mesh files of every format, made by hand, against the corners that they are made of."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from twin.errors import ModelError
from twin.geometry import Array
from twin.models import load
from twin.models.checks import check
from twin.models.mesh.hulls import hull_of
from twin.models.mesh.mesh_formats import TriangleMesh
from twin.models.mesh.meshes import mesh_faults, read_mesh
from twin.models.options import ReadOptions
from twin.models.shapes import Mesh

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
VOLUME = 1.0
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS) + "".join(f"f {a} {b} {c}\n" for a, b, c in FACES + 1)


def stl(header: bytes = b"") -> bytes:
    triangles = [struct.pack("<12fH", 0, 0, 0, *POINTS[face].ravel(), 0) for face in FACES]
    return header.ljust(80, b"\0") + struct.pack("<I", len(FACES)) + b"".join(triangles)


def ascii_stl() -> bytes:
    facets = []
    for face in FACES:
        corners = "".join(f"      vertex {x:e} {y:e} {z:e}\n" for x, y, z in POINTS[face])
        facets.append(f"  facet normal 0 0 0\n    outer loop\n{corners}    endloop\n  endfacet\n")
    return f"solid made by hand\n{''.join(facets)}endsolid\n".encode()


TRIANGLES = (
    "<triangles count='4'><input semantic='VERTEX' source='#v' offset='0'/><p>{}</p></triangles>".format(
        " ".join(map(str, FACES.ravel()))
    )
)


def dae(
    nodes: str = "<node><instance_geometry url='#g'/></node>",
    *,
    asset: str = "<up_axis>Z_UP</up_axis>",
    primitives: str = TRIANGLES,
    library: str = "",
) -> bytes:
    numbers = " ".join(map(str, POINTS.ravel()))
    params = "".join(f"<param name='{axis}' type='float'/>" for axis in "XYZ")
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{asset}</asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">{numbers}</float_array>
<technique_common><accessor source="#a" count="4" stride="3">{params}</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{primitives}</mesh></geometry>
</library_geometries>{library}<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


def msh() -> bytes:
    return struct.pack("<4i12f12i", 4, 0, 0, 4, *POINTS.ravel(), *FACES.ravel())


def read(tmp_path: Path, content: bytes, name: str = "m.dae", **options: bool) -> TriangleMesh:
    (tmp_path / name).write_bytes(content)
    return read_mesh(tmp_path / name, **options)


def volume(mesh: TriangleMesh) -> float:
    """Return the volume inside the surface; negative if it is inside out."""
    a, b, c = mesh.points[mesh.faces.T]
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


def corners(mesh: TriangleMesh) -> Array:
    return np.array(sorted(set(map(tuple, np.round(mesh.points, 9).tolist()))))


SORTED = np.array(sorted(map(tuple, POINTS.tolist())))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.stl", stl()),
        ("solid.STL", stl(b"solid exported from something")),
        ("m.stl", ascii_stl()),
        ("windows.stl", ascii_stl().upper().replace(b"\n", b"\r\n")),
        ("m.obj", OBJ.encode()),
        ("slashes.obj", OBJ.replace("f 1 3 2", "vt 0 0\nvn 0 0 1\nf 1/1/1 3/1 2//1").encode()),
        ("from_the_end.obj", OBJ.replace("f 1 3 2", "f -4 -2 -3").encode()),
        ("unused_point.obj", (OBJ + "v 99 99 99\n").encode()),
        ("m.dae", dae()),
        ("m.msh", msh()),
        ("stl_called.obj", stl()),
        ("obj_called.stl", OBJ.encode()),
        ("dae_called.stl", dae()),
    ],
)  # fmt: skip
def test_every_format_gives_the_same_tetrahedron(tmp_path: Path, name: str, content: bytes) -> None:
    mesh = read(tmp_path, content, name)
    assert_allclose(corners(mesh), SORTED, atol=1e-7)
    assert volume(mesh) == pytest.approx(VOLUME)


@pytest.mark.parametrize(
    "primitives",
    [
        "<polylist count='4'><input semantic='VERTEX' source='#v' offset='0'/><input semantic='NORMAL' "
        "source='#p' offset='1'/><vcount>3 3 3 3</vcount>"
        "<p>0 0 2 0 1 0 0 0 1 0 3 0 0 0 3 0 2 0 1 0 2 0 3 0</p></polylist>",
        "<polygons count='4'><input semantic='VERTEX' source='#v' offset='0'/>"
        "<p>0 2 1</p><p>0 1 3</p><p>0 3 2</p><p>1 2 3</p></polygons>",
        "<trifans count='2'><input semantic='VERTEX' source='#v' offset='0'/><p>0 2 1 3 2</p><p>1 2 3</p>"
        "</trifans>",
        "<tristrips count='1'><input semantic='VERTEX' source='#v' offset='0'/><p>0 2 1 3 0 2</p>"
        "</tristrips>",
        "<lines count='1'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1</p></lines>" + TRIANGLES,
        "<polygons count='0'><input semantic='VERTEX' source='#v' offset='0'/></polygons>" + TRIANGLES,
    ],
    ids=["polylist", "polygons", "trifans", "tristrips", "lines beside", "polygons without any"],
)
def test_all_polygons_of_collada_become_triangles(tmp_path: Path, primitives: str) -> None:
    mesh = read(tmp_path, dae(primitives=primitives))
    assert_allclose(corners(mesh), SORTED)
    assert volume(mesh) == pytest.approx(VOLUME)


@pytest.mark.parametrize("up", ["X_UP", "Y_UP", "Z_UP", None])
def test_collada_is_scaled_by_its_unit_and_turned_by_its_up_axis(tmp_path: Path, up: str | None) -> None:
    asset = "<unit name='centimeter' meter='0.01'/>" + (f"<up_axis>{up}</up_axis>" if up else "")
    as_it_is = read(tmp_path, dae(asset=asset), apply_up_axis=False)
    assert_allclose(corners(as_it_is), 0.01 * SORTED)
    turned = read(tmp_path, dae(asset=asset), "turned.dae")
    x, y, z = 0.01, 0.02, 0.03
    (low, high) = turned.points.min(axis=0), turned.points.max(axis=0)
    expected = {
        "X_UP": ([-y, -z, 0], [0, 0, x]),
        "Y_UP": ([0, -z, 0], [x, 0, y]),
        "Z_UP": ([0, 0, 0], [x, y, z]),
    }[up or "Z_UP"]
    assert_allclose([low, high], expected, atol=1e-12)
    assert volume(turned) == pytest.approx(1e-6)


def test_collada_nodes_place_their_geometries(tmp_path: Path) -> None:
    inner = "<node id='part'><scale>1 1 2</scale><instance_geometry url='#g'/></node>"
    nodes = (
        "<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate>"
        "<node><matrix>1 0 0 0  0 1 0 5  0 0 1 0  0 0 0 1</matrix><instance_node url='#part'/></node></node>"
        "<node><instance_geometry url='#g'/></node>"
        "<node><lookat>0 0 1 0 0 0 0 1 0</lookat><instance_camera url='#c'/></node>"
    )
    mesh = read(tmp_path, dae(nodes, library=f"<library_nodes>{inner}</library_nodes>"))
    placed = POINTS * (1, 1, 2) + (0, 5, 0)
    placed = np.stack([10.0 - placed[:, 1], placed[:, 0], placed[:, 2]], axis=1)
    assert_allclose(corners(mesh), sorted(map(tuple, np.concatenate([POINTS, placed]).tolist())), atol=1e-9)
    assert volume(mesh) == pytest.approx(3.0)


def test_a_mirrored_collada_node_is_not_inside_out(tmp_path: Path) -> None:
    mesh = read(tmp_path, dae("<node><scale>-1 1 1</scale><instance_geometry url='#g'/></node>"))
    assert volume(mesh) == pytest.approx(VOLUME)
    assert mesh.points[:, 0].min() == -1.0


def test_a_skin_is_read_in_the_pose_it_is_bound_in(tmp_path: Path) -> None:
    library = (
        "<library_controllers><controller id='c'><skin source='#g'><bind_shape_matrix>"
        "1 0 0 0 0 1 0 0 0 0 1 7 0 0 0 1</bind_shape_matrix></skin></controller></library_controllers>"
    )
    mesh = read(tmp_path, dae("<node><instance_controller url='#c'/></node>", library=library))
    assert_allclose(corners(mesh) - (0, 0, 7), SORTED)


def test_the_colour_of_most_triangles_is_read(tmp_path: Path) -> None:
    effect = (
        "<effect id='{0}e'><profile_COMMON><technique sid='t'><phong><diffuse><color>{1} 1</color></diffuse>"
        "</phong></technique></profile_COMMON></effect>"
    )
    library = (
        f"<library_effects>{effect.format('r', '1 0 0')}{effect.format('b', '0 0 1')}</library_effects>"
        "<library_materials><material id='r'><instance_effect url='#re'/></material>"
        "<material id='b'><instance_effect url='#be'/></material></library_materials>"
    )
    part = "<triangles material='{}'><input semantic='VERTEX' source='#v' offset='0'/><p>{}</p></triangles>"
    primitives = part.format("one", "0 2 1 0 1 3") + part.format("two", "0 3 2 1 2 3 1 2 3")
    bind = "".join(
        f"<instance_material symbol='{symbol}' target='#{target}'/>"
        for symbol, target in (("one", "b"), ("two", "r"))
    )
    node = f"<node><instance_geometry url='#g'><bind_material><technique_common>{bind}</technique_common>"
    content = dae(
        node + "</bind_material></instance_geometry></node>", primitives=primitives, library=library
    )
    assert read(tmp_path, content).colour == (1.0, 0.0, 0.0)
    broken = content.replace(b"#re", b"#nowhere").replace(b"#be", b"#nowhere")
    assert read(tmp_path, broken, "broken.dae").colour is None


BOMB = "".join(
    f"<node id='n{i}'><instance_node url='#n{i + 1}'/><instance_node url='#n{i + 1}'/></node>"
    for i in range(40)
)
BOMB += "<node id='n40'><instance_geometry url='#g'/></node>"
NAN = stl()[:96] + struct.pack("<f", math.nan) + stl()[100:]

BAD = {
    "empty": ("m.stl", b"", "is empty"),
    "blank": ("m.obj", b" \n\n", "is empty"),
    "truncated": ("m.stl", stl()[:-7], "is no whole STL file: its 277 bytes tell of 4 triangles"),
    "header only": ("m.stl", b"\0" * 40, "is no whole STL file"),
    "no triangles": ("m.stl", b"\0" * 84, "is no whole STL file"),
    "lies": ("m.stl", b"\0" * 80 + b"\xff\xff\xff\xff" + b"\0" * 50, "tell of 4294967295 triangles"),
    "truncated ASCII": ("m.stl", ascii_stl()[:-90], "is no whole STL file"),
    "no endsolid": ("m.stl", ascii_stl().replace(b"endsolid", b""), "is no whole STL file"),
    "words": ("m.stl", ascii_stl().replace(b"vertex 1.0", b"vertex one"), "could not convert"),
    "NaN": ("m.stl", NAN, "has points that are not finite"),
    "NaN in OBJ": ("m.obj", OBJ.replace("v 1.0", "v nan").encode(), "has points that are not finite"),
    "far": ("m.obj", OBJ.replace("v 1.0", "v 1e300").encode(), "reaches 1e+300 m far"),
    "broken line": ("m.obj", OBJ.replace("f 1 3 2", "f 1 x 2").encode(), "has a broken line 5: 'f 1 x 2'"),
    "missing point": ("m.obj", OBJ.replace("f 1 3 2", "f 1 3 9").encode(), "points that it does not have"),
    "only points": ("m.obj", b"v 0 0 0\nv 1 0 0\n", "has no triangles"),
    "one triangle": ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "less than four different points"),
    "text": ("m.obj", b"this is not a mesh", "is no mesh of a known format; STL, OBJ and COLLADA"),
    "Ogre": ("m.mesh", b"\x00\x10[MeshSerializer_v1.40]\n" + b"\0" * 99, "is an Ogre mesh"),
    "glb": ("m.glb", b"glTF\2\0\0\0", "is glTF"),
    "ply": ("m.ply", b"ply\nformat ascii 1.0\n", "is PLY"),
    "lfs": ("m.stl", b"version https://git-lfs.github.com/spec/v1\n", "was not fetched"),
    "msh": ("m.msh", msh()[:-1], "is no whole MSH file"),
    "not XML": ("m.dae", b"<COLLADA", "is not well-formed XML"),
    "not COLLADA": ("m.dae", b"<svg/>", "is no COLLADA file: its root element is <svg>"),
    "entities": ("m.dae", b"<!DOCTYPE a [<!ENTITY b 'c'>]>" + dae()[21:], "has a DOCTYPE"),
    "no scene": ("m.dae", b"<COLLADA/>", "has no scene"),
    "empty scene": ("m.dae", dae(""), "has no triangles in its scene"),
    "broken url": ("m.dae", dae("<node><instance_geometry url='#h'/></node>"), "refers to '#h'"),
    "outside url": ("m.dae", dae("<node><instance_geometry url='/etc/x#h'/></node>"), "refers to '/etc/x#h'"),
    "itself": ("m.dae", dae("<node id='n'><instance_node url='#n'/></node>"), "more than 20000 nodes"),
    "doubling": ("m.dae", dae(BOMB), "more than 20000"),
    "skew": ("m.dae", dae("<node><skew>1 2 3</skew><instance_geometry url='#g'/></node>"), "by <skew>"),
    "short matrix": ("m.dae", dae("<node><matrix>1</matrix><instance_geometry url='#g'/></node>"), "reshape"),
    "index": ("m.dae", dae(primitives=TRIANGLES.replace("0 2 1", "0 9 1")), "0 to 9, of 4"),
    "huge polygon": (
        "m.dae",
        dae(primitives="<polylist><input semantic='VERTEX' source='#v' offset='0'/>"
            "<vcount>2000000000</vcount><p>0 1 2</p></polylist>"),
        "has polygons of 2000000000 corners",
    ),
    "unit": ("m.dae", dae(asset="<unit meter='0'/>"), "has a unit of 0 m"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_one_sentence(tmp_path: Path, case: str) -> None:
    name, content, message = BAD[case]
    with pytest.raises(ModelError) as caught:
        read(tmp_path, content, name)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.file == tmp_path / name
    assert problem.code in ("mesh-format", "bad-mesh")


def test_every_truncation_and_flipped_byte_is_read_or_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    for index, (name, whole) in enumerate(
        (("a.stl", stl()), ("b.stl", ascii_stl()), ("c.dae", dae()), ("d.obj", OBJ.encode()))
    ):
        for trial in range(40):
            damaged = bytearray(whole[: rng.integers(len(whole))] if trial % 2 else whole)
            for place in rng.integers(len(damaged), size=3) if damaged else ():
                damaged[place] = rng.integers(256)
            try:
                mesh = read(tmp_path, bytes(damaged), f"{index}-{trial}{name[1:]}")
            except ModelError:
                continue
            assert np.all(np.isfinite(mesh.points))


def test_a_file_is_read_once_and_again_after_a_change(tmp_path: Path) -> None:
    first = read(tmp_path, stl(), "m.stl")
    assert read_mesh(tmp_path / "m.stl") is first
    assert_allclose(read(tmp_path, OBJ.replace("v 1.0", "v 5.0").encode(), "m.stl").points.max(), 5.0)


def test_a_hull_has_the_properties_of_the_solid(tmp_path: Path) -> None:
    (tmp_path / "m.stl").write_bytes(stl())
    hull = hull_of(Mesh(path=tmp_path / "m.stl", scale=(1.0, -1.0, 2.0)))
    assert hull is not None
    assert hull.volume == pytest.approx(2.0)
    assert_allclose(hull.centroid, (0.25, -0.5, 1.5))
    # a corner tetrahedron with legs a, b, c: the variance along a leg is 3/80 of its square, covariance -1/80
    a, b, c = 1.0, -2.0, 6.0
    squares = 3.0 / 80.0 * np.array([a * a, b * b, c * c])
    assert_allclose(np.diag(hull.gyration), squares.sum() - squares)
    assert_allclose(hull.gyration[0, 1], a * b / 80.0)


INERTIAL = "<inertial><mass value='1'/><inertia ixx='0.4' iyy='0.3' izz='0.2'/></inertial>"


def robot(tmp_path: Path, shapes: str) -> Path:
    (tmp_path / "good.stl").write_bytes(stl())
    (tmp_path / "broken.stl").write_bytes(stl()[:-1])
    (tmp_path / "flat.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 4 3\n")
    file = tmp_path / "r.urdf"
    file.write_text(f"<robot name='r'>\n<link name='a'>{INERTIAL}\n{shapes}</link></robot>", encoding="utf-8")
    return file


def shape(name: str, role: str = "visual", scale: str = "1 1 1") -> str:
    return f"<{role}><geometry><mesh filename='{name}' scale='{scale}'/></geometry></{role}>\n"


def test_missing_meshes_are_errors_all_at_once(tmp_path: Path) -> None:
    file = robot(tmp_path, shape("a.stl") + shape("b.dae", "collision") + shape("x" * 5000))
    with pytest.raises(ModelError) as caught:
        load(file)
    assert [(problem.code, problem.line) for problem in caught.value.problems] == [
        ("missing-mesh", line) for line in (3, 4, 5)
    ]


def test_a_scale_of_zero_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"r\.urdf:3: mesh 'good\.stl' of link 'a' has a scale of zero"):
        load(robot(tmp_path, shape("good.stl", scale="1 0 1")))


def test_unusable_meshes_are_diagnostics_with_link_and_line(tmp_path: Path) -> None:
    description = load(
        robot(
            tmp_path,
            shape("good.stl") + shape("broken.stl") + shape("flat.obj") + shape("flat.obj", "collision"),
        )
    )
    found = [diagnostic for diagnostic in check(description) if diagnostic.severity == "error"]
    assert [(d.code, d.element, d.line) for d in found] == [
        ("mesh-format", "link 'a'", 4),
        ("bad-mesh", "link 'a'", 6),
    ]
    assert "mesh 'broken.stl' of link 'a' is no whole STL file" in found[0].message
    assert len(mesh_faults(description, visuals=False)) == 1


def test_missing_and_unreadable_meshes_are_left_out_on_demand(tmp_path: Path) -> None:
    file = robot(tmp_path, shape("good.stl") + shape("broken.stl") + shape("gone.stl", "collision"))
    description = load(file, ReadOptions(missing_mesh="skip"))
    assert len(description.links["a"].visuals) == 1
    assert not description.links["a"].collisions
    found = [diagnostic for diagnostic in check(description) if diagnostic.code == "skipped-mesh"]
    assert [(d.severity, d.element, d.line) for d in found] == [
        ("warning", "link 'a'", 4),
        ("warning", "link 'a'", 5),
    ]
    assert "mesh 'broken.stl' is no whole STL file" in found[0].message
    assert "its collision is left out: mesh 'gone.stl' does not exist" in found[1].message
