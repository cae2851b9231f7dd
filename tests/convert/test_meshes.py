"""Meshes in MuJoCo models: where their corners are, what is written, what checks see in them."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from twin.convert import convert
from twin.convert.export import export
from twin.convert.geoms import wheel_ellipsoid
from twin.convert.inspection import inspect_file, inspect_robot
from twin.errors import ConversionError
from twin.geometry import Array, Pose3
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.mesh.meshes import read_mesh
from twin.models.options import ReadOptions
from twin.models.shapes import Box, Collision, Cylinder, Geometry, Sphere

POINTS = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
INERTIAL = "<inertial><mass value='1'/><inertia ixx='0.004' iyy='0.003' izz='0.002'/></inertial>"
EFFECT = (
    "<library_effects><effect id='e'><profile_COMMON><technique sid='t'><lambert><diffuse>"
    "<color>0.2 0.4 0.6 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>"
    "<library_materials><material id='m'><instance_effect url='#e'/></material></library_materials>"
)


def stl(points: Array, faces: Array) -> bytes:
    triangles = [struct.pack("<12fH", 0, 0, 0, *points[face].ravel(), 0) for face in faces]
    return b"solid".ljust(80, b"\0") + struct.pack("<I", len(faces)) + b"".join(triangles)


def ascii_stl(points: Array, faces: Array) -> bytes:
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points[face])
        + "endloop\nendfacet\n"
        for face in faces
    )
    return f"solid x\n{''.join(facets)}endsolid x\n".encode()


def dae(points: Array, faces: Array, unit: float = 1.0) -> bytes:
    numbers, indices = (" ".join(map(repr, a.ravel().tolist())) for a in (points, faces))
    return f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{unit}"/><up_axis>Z_UP</up_axis></asset>{EFFECT}
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a">{numbers}</float_array><technique_common>
<accessor source="#a" count="{len(points)}" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles material="m">
<input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


def disc(radius: float, width: float) -> tuple[Array, Array]:
    """Return a cylinder about y as a mesh."""
    angles = np.arange(32) * (2.0 * math.pi / 32)
    ring = np.stack([radius * np.cos(angles), np.zeros(32), radius * np.sin(angles)], axis=1)
    half = np.array([0.0, width / 2, 0.0])
    points = np.concatenate([ring - half, ring + half])
    sides = [(i, (i + 1) % 32, 32 + i) for i in range(32)] + [
        ((i + 1) % 32, 32 + (i + 1) % 32, 32 + i) for i in range(32)
    ]
    lids = [(0, i + 1, i) for i in range(1, 31)] + [(32, 32 + i, 33 + i) for i in range(1, 31)]
    return points, np.array(sides + lids)


def mesh(name: str, role: str = "visual", *, scale: str = "1 1 1", origin: str = "") -> str:
    return f"<{role}>{origin}<geometry><mesh filename='{name}' scale='{scale}'/></geometry></{role}>\n"


def robot(tmp_path: Path, body: str, **files: bytes) -> Path:
    (tmp_path / "src").mkdir(exist_ok=True)
    for name, content in files.items():
        (tmp_path / "src" / name.replace("_", ".")).write_bytes(content)
    path = tmp_path / "src" / "r.urdf"
    path.write_text(f"<robot name='r'>\n{body}</robot>", encoding="utf-8")
    return path


def link(shapes: str, name: str = "a") -> str:
    return f"<link name='{name}'>{INERTIAL}\n{shapes}</link>\n"


def compiled(description: RobotDescription) -> mujoco.MjModel:
    return convert(description, base="fixed").spec.compile()


def surface(model: mujoco.MjModel, geom: int) -> Array:
    """Return the triangles of a mesh geom in the world, shape (n, 3, 3) [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    index = model.geom_dataid[geom]
    first, count = model.mesh_vertadr[index], model.mesh_vertnum[index]
    points = model.mesh_vert[first : first + count] @ data.geom_xmat[geom].reshape(3, 3).T
    faces = model.mesh_face[model.mesh_faceadr[index] :][: model.mesh_facenum[index]]
    return (points + data.geom_xpos[geom])[faces]


def volume(triangles: Array) -> float:
    a, b, c = triangles.transpose(1, 0, 2)
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("kind", ["stl", "ascii", "dae", "obj"])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.0, 1.0, 0.5), (-1.0, 1.0, 1.0), (-1.0, -2.0, -1.0)])
@pytest.mark.parametrize("role", ["visual", "collision"])
def test_corners_and_volume_are_those_of_the_file(
    tmp_path: Path, kind: str, scale: tuple[float, float, float], role: str
) -> None:
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS) + "".join(
        f"f {a} {b} {c}\n" for a, b, c in FACES + 1
    )
    content = {
        "stl": stl(POINTS, FACES),
        "ascii": ascii_stl(POINTS, FACES),
        "dae": dae(1000.0 * POINTS, FACES, unit=0.001),
        "obj": (obj + "v 9 9 9\n").encode(),  # a point that no triangle uses
    }[kind]
    shape = mesh(
        "m.x", role, scale=" ".join(map(str, scale)), origin="<origin xyz='1 2 3' rpy='0.3 0.2 0.1'/>"
    )
    description = load(robot(tmp_path, link(shape), m_x=content))
    pose = (*description.links["a"].visuals, *description.links["a"].collisions)[0].T_link_geometry
    model = compiled(description)
    assert model.nmeshvert == len(POINTS)
    triangles = surface(model, 0)
    expected = pose.apply(POINTS * scale)
    found = np.array(sorted(set(map(tuple, np.round(triangles.reshape(-1, 3), 5).tolist()))))
    assert_allclose(found, np.array(sorted(map(tuple, expected.tolist()))), atol=2e-5)
    assert volume(triangles) == pytest.approx(0.001 * abs(math.prod(scale)), rel=1e-3)


@pytest.mark.parametrize(("apply", "expected"), [(True, (1.0, -3.0, 2.0)), (False, (1.0, 2.0, 3.0))])
def test_a_collada_file_is_turned_as_it_says_and_this_is_warned_about(
    tmp_path: Path, apply: bool, expected: tuple[float, float, float]
) -> None:
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)])
    content = dae(points, FACES).replace(b"Z_UP", b"Y_UP")
    file = robot(tmp_path, link(mesh("m.dae") + mesh("m.dae", "collision")), m_dae=content)
    description = load(file, ReadOptions(apply_up_axis=apply))
    extremes = np.concatenate(surface(compiled(description), 0))
    found = [extremes[:, axis].min() + extremes[:, axis].max() for axis in range(3)]
    assert_allclose(found, expected, atol=1e-6)
    warnings = [item for item in inspect_robot(description) if item.code == "turned-mesh"]
    assert len(warnings) == apply
    if apply:
        assert "'m.dae' says Y_UP" in warnings[0].message


def test_export_writes_one_binary_asset_per_content_the_same_each_time(tmp_path: Path) -> None:
    shapes = mesh("a.dae") + mesh("a.dae", scale="-2 1 1") + mesh("b.dae") + mesh("c.stl", "collision")
    same = dae(POINTS, FACES)
    path = robot(tmp_path, link(shapes), a_dae=same, b_dae=same, c_stl=ascii_stl(POINTS, FACES))
    reports = [export(load(path), tmp_path / name) for name in ("one", "two")]
    assert reports[0] == reports[1]
    assert [name.rpartition("-")[0] for name in reports[0]["assets"]] == ["a", "b", "c"]
    assert all(name.endswith(".stl") for name in reports[0]["assets"])
    for file in sorted((tmp_path / "one").rglob("*.*")):
        assert file.read_bytes() == (tmp_path / "two" / file.relative_to(tmp_path / "one")).read_bytes()
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "one" / "robot.xml"))
    assert model.nmesh == 4
    straight = compiled(load(path))
    for geom in range(4):
        assert_allclose(surface(model, geom), surface(straight, geom), atol=1e-7)
    notes = {entry["note"] for entry in reports[0]["ledger"] if entry["element"].endswith("geometry/mesh")}
    assert notes == {"mesh in assets/", "mesh in assets/; its convex hull is touched"}


def test_a_mesh_with_more_triangles_than_mujoco_reads_from_stl(tmp_path: Path) -> None:
    many = np.tile(FACES, (50_001, 1))
    path = robot(tmp_path, link(mesh("m.stl")), m_stl=stl(POINTS, FACES)[:80] + struct.pack("<I", len(many))
                 + stl(POINTS, FACES)[84:] * 50_001)  # fmt: skip
    report = export(load(path), tmp_path / "out")
    assert [name[-4:] for name in report["assets"]] == [".msh"]


def test_the_simulator_reads_no_mesh_that_is_seen_only(tmp_path: Path) -> None:
    path = robot(
        tmp_path,
        link(mesh("broken.stl") + mesh("c.stl", "collision")),
        broken_stl=b"?",
        c_stl=stl(POINTS, FACES),
    )
    model = convert(load(path), visuals=False).spec.compile()
    assert (model.ngeom, model.nmesh) == (1, 1)
    with pytest.raises(ConversionError, match=r"r\.urdf:3: mesh 'broken\.stl' of link 'a' is no whole STL"):
        convert(load(path))


def test_a_visual_without_material_has_the_colour_of_its_mesh(tmp_path: Path) -> None:
    red = mesh("a.dae").replace("</v", "<material name='r'><color rgba='1 0 0 1'/></material></v")
    path = robot(tmp_path, link(mesh("a.dae") + red + mesh("c.stl")), a_dae=dae(POINTS, FACES),
                 c_stl=stl(POINTS, FACES))  # fmt: skip
    colours = compiled(load(path)).geom_rgba
    assert_allclose(colours, [(0.2, 0.4, 0.6, 1.0), (1.0, 0.0, 0.0, 1.0), (0.7, 0.7, 0.7, 1.0)], atol=1e-6)


def test_two_robots_with_the_same_meshes_share_a_world(tmp_path: Path) -> None:
    path = robot(tmp_path, link(mesh("c.dae", "collision")), c_dae=dae(POINTS, FACES))
    world = mujoco.MjSpec()
    for prefix in ("a/", "b/"):
        world.attach(convert(load(path)).spec.copy(), prefix=prefix, frame=world.worldbody.add_frame())
    assert world.compile().nmesh == 2


def test_skipped_meshes_are_dropped_in_the_ledger(tmp_path: Path) -> None:
    path = robot(tmp_path, link(mesh("gone.dae") + mesh("c.stl", "collision")), c_stl=stl(POINTS, FACES))
    export(load(path, ReadOptions(missing_mesh="skip")), tmp_path / "out")
    report = json.loads((tmp_path / "out" / "report.json").read_text("utf-8"))
    fates = [(e["line"], e["outcome"]) for e in report["ledger"] if e["element"].endswith("geometry/mesh")]
    assert fates == [(3, "dropped"), (4, "translated")]
    assert [d["line"] for d in report["diagnostics"] if d["code"] == "skipped-mesh"] == [3]


WHEEL = "<inertial><mass value='0.1'/><inertia ixx='7e-5' iyy='1.25e-4' izz='7e-5'/></inertial>"
CART = """<link name='base'>
<inertial><mass value='1'/><inertia ixx='0.004' iyy='0.008' izz='0.011'/></inertial>
<collision><geometry><mesh filename='box.stl'/></geometry></collision></link>
{}<link name='caster'><collision><geometry><sphere radius='0.02'/></geometry></collision></link>
<joint name='k' type='fixed'><origin xyz='0.12 0 -0.03'/><parent link='base'/><child link='caster'/></joint>
"""
SIDE = """<link name='{0}'>{2}
<collision><origin rpy='{3}'/><geometry><mesh filename='disc.dae'/></geometry></collision></link>
<joint name='{0}_joint' type='continuous'><origin xyz='0 {1} 0'/><parent link='base'/><child link='{0}'/>
<axis xyz='0 1 0'/><limit effort='2' velocity='9'/></joint>
"""


def cart(
    tmp_path: Path, *, height: float = 0.06, rpy: str = "0 0 0", scale: float = 1.0
) -> set[tuple[str, str]]:
    """Return the codes and elements found on a cart whose base and wheels are meshes."""
    corners = np.array([(x, y, z) for x in (-0.15, 0.15) for y in (-0.1, 0.1) for z in (-0.5, 0.5)])
    corners *= (scale, scale, scale * height)
    box = np.array([(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5), (2, 3, 7), (2, 7, 6),
                    (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])  # fmt: skip
    sides = SIDE.format("left", "0.15", WHEEL, rpy) + SIDE.format("right", "-0.15", WHEEL, "0 0 0")
    path = robot(tmp_path, CART.format(sides), box_stl=stl(corners, box), disc_dae=dae(*disc(0.05, 0.02)))
    return {(found.code, found.element) for found in inspect_file(path).diagnostics}


def test_a_sound_cart_of_meshes_is_left_alone(tmp_path: Path) -> None:
    assert cart(tmp_path) == {("missing-drive", "robot")}


def test_checks_look_into_meshes(tmp_path: Path) -> None:
    assert ("wheel-axis", "link 'left'") in cart(tmp_path, rpy="1.5707963 0 0")
    assert ("base-on-ground", "link 'base'") in cart(tmp_path, height=0.1)
    assert ("wheels-off-ground", "link 'base'") in cart(tmp_path, height=0.12)
    assert ("inertia-too-small", "link 'base'") in cart(tmp_path, scale=1000.0)
    assert ("inertia-too-large", "link 'base'") in cart(tmp_path, scale=0.3)


def test_a_forgotten_scale_and_a_mesh_elsewhere_are_seen(tmp_path: Path) -> None:
    def diagnose(shapes: str) -> list[str]:
        files = {"m_stl": stl(POINTS, FACES), "mm_stl": stl(1000.0 * POINTS, FACES)}
        found = inspect_file(robot(tmp_path, link(shapes), **files)).diagnostics
        return [item.message for item in found if item.code == "visual-collision"]

    assert "its visual is 1e+03 times as large" in diagnose(mesh("mm.stl") + mesh("m.stl", "collision"))[0]
    moved = mesh("m.stl", "collision", origin="<origin xyz='0.3 0 0'/>")
    assert "0.2 m apart" in diagnose(mesh("m.stl") + moved)[0]
    assert not diagnose(mesh("mm.stl", scale="0.001 0.001 0.001") + mesh("m.stl", "collision"))


def test_hulls_inside_of_each_other_overlap(tmp_path: Path) -> None:
    chain = "".join(link(mesh("m.stl", "collision"), name) for name in "abc")
    for parent, child, x in (("a", "b", 0.2), ("b", "c", -0.15)):
        chain += f"<joint name='{child}j' type='continuous'><origin xyz='{x} 0 0'/><parent link='{parent}'/>"
        chain += f"<child link='{child}'/></joint>"
    path = robot(tmp_path, chain, m_stl=stl(POINTS, FACES))
    found = [item for item in inspect_file(path).diagnostics if item.code == "overlap"]
    assert [item.element for item in found] == ["link 'c'"]
    apart = load(robot(tmp_path, chain.replace("-0.15", "0.2"), m_stl=stl(POINTS, FACES)))
    assert not [item for item in inspect_robot(apart) if item.code == "overlap"]


def test_meshes_of_real_robots_are_where_pinocchio_sees_them() -> None:
    coal = pytest.importorskip("coal", reason="pin is not installed")
    folders = Path(coal.__file__).parents[4] / "share" / "example-robot-data" / "robots"
    if not folders.is_dir():
        pytest.skip("example-robot-data is not installed")
    files = [file for file in sorted(folders.rglob("*.*")) if file.suffix.lower() in (".dae", ".stl", ".obj")]
    some = [file for file in files[::23] if file.stat().st_size < 2_000_000]
    assert len(some) > 20
    loader = coal.MeshLoader()
    for file in some:
        points = read_mesh(file, apply_up_axis=False).points
        expected = loader.load(str(file))
        expected.computeLocalAABB()
        size = np.linalg.norm(np.ptp(points, axis=0))
        assert_allclose(points.min(axis=0), expected.aabb_local.min_, atol=1e-5 * size, err_msg=file.name)
        assert_allclose(points.max(axis=0), expected.aabb_local.max_, atol=1e-5 * size, err_msg=file.name)


def test_a_wheel_rolls_as_the_ellipsoid_in_its_cylinder() -> None:
    pose = Pose3.from_xyz_rpy((0.1, 0.2, 0.3), (math.pi / 2, 0.0, 0.0))

    def ellipsoid(geometry: Geometry) -> tuple[Pose3, list[float]] | None:
        return wheel_ellipsoid(Collision(geometry=geometry, T_link_geometry=pose))

    found = ellipsoid(Cylinder(radius=0.05, length=0.02))
    assert found == (pose, [0.05, 0.05, 0.01])
    assert ellipsoid(Cylinder(radius=0.05, length=0.5)) == (pose, [0.05, 0.05, 0.25]), "a roller"
    assert ellipsoid(Box(size=(0.1, 0.1, 0.1))) is None
    assert ellipsoid(Sphere(radius=0.1)) is None
