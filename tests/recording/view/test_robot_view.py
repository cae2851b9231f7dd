"""A robot in the viewer: what is drawn is where forward kinematics says, and says what the file says."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.errors import ModelError
from twin.geometry import Pose3, matrix_from_quat_wxyz
from twin.models import link_poses, load
from twin.models.description import Inertial, RobotDescription
from twin.recording.read_back import content_digest, read
from twin.recording.view.posture import Posture
from twin.recording.view.robot_layers import LAYERS, inertia_box
from twin.recording.view.robot_view import save

BOX = "<geometry><box size='0.2 0.1 0.1'/></geometry>"
MASS = "<inertial><mass value='2'/><inertia ixx='0.01' iyy='0.02' izz='0.03'/></inertial>"
EVERY_JOINT = f"""<robot name='every joint'>
<link name='base'>{MASS}<visual>{BOX}</visual></link>
<link name='a b'><visual><origin xyz='0 0 0.1'/>{BOX}</visual><collision>{BOX}</collision></link>
<link name='c/d'/><link name='f'/><link name='g'/><link name='p'/><link name='o'/>
<joint name='turn' type='revolute'><origin xyz='0 0 0.3' rpy='0.1 0.2 0.3'/><parent link='base'/>
  <child link='a b'/><axis xyz='0 1 0'/><limit lower='0.5' upper='1.5' effort='1' velocity='1'/></joint>
<joint name='slide' type='prismatic'><origin xyz='0.1 0 0'/><parent link='a b'/><child link='c/d'/>
  <axis xyz='1 1 0'/><limit lower='-0.2' upper='0.4' effort='1' velocity='1'/></joint>
<joint name='follow' type='revolute'><parent link='c/d'/><child link='f'/><axis xyz='0 0 1'/>
  <limit lower='-9' upper='9' effort='1' velocity='1'/><mimic joint='turn' multiplier='-2' offset='0.25'/>
  </joint>
<joint name='spin' type='continuous'><parent link='f'/><child link='g'/><axis xyz='0 0 1'/></joint>
<joint name='plane' type='planar'><parent link='base'/><child link='p'/><axis xyz='0 0 1'/></joint>
<joint name='fly' type='floating'><parent link='base'/><child link='o'/></joint>
</robot>"""


@pytest.fixture
def robot(tmp_path: Path) -> RobotDescription:
    file = tmp_path / "every.urdf"
    file.write_text(EVERY_JOINT, encoding="utf-8")
    return load(file)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["every.urdf", "warehouse_bot", "r2d2"])
def test_recorded_frames_are_forward_kinematics(
    name: str, seed: int, robot: RobotDescription, tmp_path: Path, recorded_poses: Any
) -> None:
    description = robot if name == "every.urdf" else load(name)
    posture = Posture(description)
    posture.preset("random", np.random.default_rng(seed))
    save(tmp_path / "a.rrd", posture, description)
    poses = recorded_poses(read(tmp_path / "a.rrd"), description.root)
    expected = link_poses(description, posture.positions)
    assert poses.keys() == expected.keys()
    for link, pose in expected.items():
        assert poses[link].xyz == pytest.approx(pose.xyz, abs=1e-6), link
        assert matrix_from_quat_wxyz(poses[link].quat_wxyz) == pytest.approx(
            matrix_from_quat_wxyz(pose.quat_wxyz), abs=2e-6
        ), link


def test_followers_planes_and_free_bodies_move(robot: RobotDescription) -> None:
    posture = Posture(robot)
    posture.set({"turn": 1.0, "plane/x": 0.5, "plane/y": -0.25, "plane/yaw": math.pi / 2, "fly/z": 2.0})
    assert posture.followers["follow"] == pytest.approx(-2.0 * 1.0 + 0.25)
    poses = link_poses(robot, posture.positions)
    assert poses["p"].xyz == pytest.approx((0.5, -0.25, 0.0))
    assert poses["p"].apply((1.0, 0.0, 0.0)) == pytest.approx((0.5, 0.75, 0.0))
    assert poses["o"].xyz == pytest.approx((0.0, 0.0, 2.0))


def test_presets_are_those_of_joint_state_publisher(robot: RobotDescription) -> None:
    posture = Posture(robot)
    assert posture.values["turn"] == 1.0  # zero is out of range: the middle
    assert posture.values["slide"] == 0.0
    posture.preset("center", np.random.default_rng(0))
    assert posture.values["slide"] == pytest.approx(0.1)
    assert posture.values["spin"] == 0.0
    posture.preset("random", np.random.default_rng(0))
    assert 0.5 <= posture.values["turn"] <= 1.5
    assert len({posture.values[name] for name in ("turn", "slide", "spin", "plane/x")}) == 4
    posture.preset("zero", np.random.default_rng(0))
    assert posture.values == Posture(robot).values


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tunr": 1.0}, r"no joint 'tunr' to set: did you mean 'turn'"),
        ({"turn": 0.4}, r"joint 'turn': 0\.4 is outside of its limits \[0\.5, 1\.5\] rad"),
        ({"slide": 1.0}, r"limits \[-0\.2, 0\.4\] m"),
        ({"spin": math.nan}, "not a finite number"),
        ({"follow": 1.0}, "follows 'turn', set that one"),
        ({"plane": 1.0}, "did you mean 'plane/"),
    ],
)
def test_what_cannot_be_set(robot: RobotDescription, values: dict[str, float], message: str) -> None:
    posture = Posture(robot)
    before = posture.values
    with pytest.raises(ModelError, match=message):
        posture.set({"plane/x": 0.1, **values})
    assert posture.values == before
    posture.set({"spin": 40.0})  # continuous joints have no limits


def test_layers_are_all_there_and_only_visuals_are_seen_at_first(
    robot: RobotDescription, tmp_path: Path
) -> None:
    save(tmp_path / "a.rrd", Posture(robot), robot)
    recording = read(tmp_path / "a.rrd")
    tops = {entity.split("/")[1] for entity in recording.entities}
    assert tops - {"tf", "tf_static", ""} == set(LAYERS)
    (size,) = recording.column(r"/visual/a\ b", "Boxes3D:half_sizes").values[0]
    (centre,) = recording.column(r"/visual/a\ b", "Boxes3D:centers").values[0]
    assert size == pytest.approx((0.1, 0.05, 0.05))
    assert centre == pytest.approx((0.0, 0.0, 0.1))
    assert recording.column(r"/frames/c\/d", "CoordinateFrame:frame").values == [["c/d"]]
    assert recording.column("/centre_of_mass/base", "Ellipsoids3D:labels").values == [["2 kg"]]


def test_the_same_robot_gives_the_same_recording(robot: RobotDescription, tmp_path: Path) -> None:
    posture = Posture(robot)
    for name in ("a", "b"):
        save(tmp_path / f"{name}.rrd", posture, robot)
    posture.set({"turn": 0.6})
    save(tmp_path / "c.rrd", posture, robot)
    a, b, c = (content_digest(tmp_path / f"{name}.rrd") for name in "abc")
    assert a == b != c


def test_inertia_box_has_the_inertia() -> None:
    mass, (x, y, z) = 3.0, (0.4, 0.2, 0.1)
    moments = mass / 12.0 * np.diag((y * y + z * z, x * x + z * z, x * x + y * y))
    R = matrix_from_quat_wxyz(Pose3.from_xyz_rpy(rpy=(0.3, 0.5, 0.7)).quat_wxyz)
    size, axes = inertia_box(Inertial(T_link_com=Pose3.from_xyz_rpy(), mass=mass, inertia=R @ moments @ R.T))
    assert sorted(size) == pytest.approx([z, y, x])
    assert np.linalg.det(axes) == pytest.approx(1.0)
    longest = axes[:, int(np.argmax(size))]
    assert abs(longest @ R[:, 0]) == pytest.approx(1.0)


COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique><lambert><diffuse><color>1 0 0 1</color></diffuse>
</lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="12">0 0 0 100 0 0 0 200 0
0 0 300</float_array><technique_common><accessor source="#a" count="4" stride="3"><param type="float"/>
<param type="float"/><param type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="3"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2</p></triangles>
<triangles count="1" material="red"><input semantic="VERTEX" source="#v" offset="0"/><p>1 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"><bind_material>
<technique_common>
<instance_material symbol="red" target="#m"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def test_meshes_have_their_size_their_colours_and_their_outside(tmp_path: Path) -> None:
    (tmp_path / "a.dae").write_text(COLLADA, encoding="utf-8")
    shape = "<geometry><mesh filename='a.dae' scale='2 2 -2'/></geometry>"
    (tmp_path / "r.urdf").write_text(
        f"<robot name='r'><link name='a'><visual><origin xyz='0 0 1'/>{shape}"
        f"<material name='m'><color rgba='0 0 1 1'/></material></visual><collision>{shape}</collision>"
        "</link></robot>"
    )
    robot = load(tmp_path / "r.urdf")
    save(tmp_path / "a.rrd", Posture(robot), robot)
    recording = read(tmp_path / "a.rrd")

    def logged(layer: str, what: str) -> np.ndarray:
        return np.array(recording.column(f"/{layer}/a/mesh_0", f"Mesh3D:{what}").values[0])

    points = logged("visual", "vertex_positions")
    np.testing.assert_allclose(points.min(axis=0), (0.0, 0.0, 1.0 - 6.0), atol=1e-6)
    np.testing.assert_allclose(points.max(axis=0), (2.0, 4.0, 1.0), atol=1e-6)
    inside = np.mean(np.unique(points, axis=0), axis=0)
    outwards = np.sum((points - inside) * logged("visual", "vertex_normals"), axis=1)
    assert np.all(outwards > 0.0)
    blue, red = 0x0000FFFF, 0xFF0000FF
    assert logged("visual", "vertex_colors").tolist() == [blue] * 9 + [red] * 3
    assert len(set(logged("collision", "vertex_colors").tolist())) == 1


def test_a_robot_of_one_link(tmp_path: Path, recwarn: Any) -> None:
    (tmp_path / "r.urdf").write_text("<robot name='r'><link name='only'/></robot>")
    robot = load(tmp_path / "r.urdf")
    save(tmp_path / "a.rrd", Posture(robot), robot)
    assert read(tmp_path / "a.rrd").entities
