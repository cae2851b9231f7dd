"""What `twin convert` writes: a model that plain MuJoCo loads, exact, whole or not at all, and a report."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from lxml import etree

from twin.convert import convert
from twin.convert.contact_roles import roles_of
from twin.convert.export import export
from twin.convert.inspection import inspect_file
from twin.convert.ledger.tags import tag_ledger
from twin.convert.self_check import self_check
from twin.errors import ConversionError
from twin.models import catalogue, load
from twin.models.checks import check
from twin.models.description import RobotDescription

ROBOTS = tuple(catalogue())
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
INERTIAL = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"


def saved(folder: Path, body: str) -> RobotDescription:
    folder.mkdir(exist_ok=True)
    file = folder / "r.urdf"
    file.write_text(f"<robot name='r'>\n{body}\n</robot>", encoding="utf-8")
    return load(file)


def everything(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_numbers_beside_others_that_are_nearly_zero_are_exact_too(tmp_path: Path) -> None:
    """MuJoCo writes such as 1e-17 as 0, which does not make the rest of the vector any rounder."""
    tiny = "<inertia ixx='1.23456789e-2' ixy='1e-13' ixz='0' iyy='2.3456789e-2' iyz='0' izz='3.456789e-2'/>"
    description = saved(
        tmp_path,
        f"<link name='base'>{INERTIAL}</link><link name='tip'><inertial><origin xyz='0.123456789 1e-15 0'/>"
        f"<mass value='1.23456789'/>{tiny}</inertial></link>"
        "<joint name='j' type='continuous'>"
        "<origin xyz='0.3333333333 -1e-14 0' rpy='1.5707963267948966 0 0.1'/>"
        "<parent link='base'/><child link='tip'/><axis xyz='0.6 1e-15 0.8'/></joint>",
    )
    export(description, tmp_path / "out", base="fixed")
    body = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml")).body("tip")
    assert body.pos[0] == 0.3333333333
    assert body.ipos[0] == 0.123456789


@pytest.mark.parametrize("robot", ROBOTS)
def test_written_model_is_exact(robot: str, tmp_path: Path) -> None:
    report = export(load(robot), tmp_path / "out")
    assert report["self_check"]["passed"]
    assert max(report["self_check"][key] for key in ("mass", "kinematics", "mass_matrix", "gravity")) < 1e-12
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    direct = convert(load(robot)).spec.compile()
    for array in ("geom_pos", "geom_size", "jnt_range", "jnt_axis", "body_mass", "actuator_gainprm"):
        np.testing.assert_array_equal(getattr(model, array), getattr(direct, array), err_msg=array)
    np.testing.assert_array_equal(model.eq_data, direct.eq_data)


def test_a_free_robot_stands_on_the_floor(tmp_path: Path) -> None:
    report = export(load("r2d2"), tmp_path / "out")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert model.body(load("r2d2").root).pos[2] == pytest.approx(0.7)
    fixed = export(load("r2d2"), tmp_path / "fixed", base="fixed")
    assert (report["base"], fixed["base"]) == ("free", "fixed")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "fixed" / "robot.xml")).nv == model.nv - 6


def test_the_same_bytes_each_time_and_no_path_of_this_machine(tmp_path: Path) -> None:
    for name in ("one", "two"):
        export(load("warehouse_bot"), tmp_path / name)
    export(load("warehouse_bot"), tmp_path / "two")  # replaces the earlier conversion
    one = everything(tmp_path / "one")
    assert one == everything(tmp_path / "two")
    assert not any(str(Path.cwd()).encode() in content for content in one.values())
    assert not any(str(tmp_path).encode() in content for content in one.values())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]


def test_meshes_are_copied_once_by_content(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    for name in ("a.obj", "b.OBJ"):
        (tmp_path / "src" / name).write_text(TETRAHEDRON, encoding="utf-8")
    shapes = "".join(
        f"<visual><geometry><mesh filename='{name}' scale='{scale} 1 1'/></geometry></visual>"
        for name, scale in (("a.obj", 1), ("a.obj", 2), ("b.OBJ", 1))
    )
    description = saved(tmp_path / "src", f"<link name='a'>{INERTIAL}{shapes}</link>")
    report = export(description, tmp_path / "out")
    assert len(report["assets"]) == 2
    assert sorted(p.name for p in (tmp_path / "out" / "assets").iterdir()) == report["assets"]
    (tmp_path / "out").rename(tmp_path / "moved")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "moved" / "robot.xml"))
    assert model.nmesh == 3
    np.testing.assert_allclose(sorted(model.mesh_scale[:, 0]), [1.0, 1.0, 2.0])


def test_nothing_is_written_on_an_error(tmp_path: Path) -> None:
    joint = "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
    massless = saved(tmp_path / "src", f"<link name='a'>{INERTIAL}</link><link name='b'/>{joint}")
    with pytest.raises(ConversionError, match="link 'b' moves and has no mass"):
        export(massless, tmp_path / "deep" / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["src"]
    foreign = tmp_path / "out"
    foreign.mkdir()
    (foreign / "thesis.tex").write_text("years of work", encoding="utf-8")
    with pytest.raises(ConversionError, match=r"holds other files \(thesis\.tex\)"):
        export(load("diff_bot"), foreign)
    assert everything(foreign) == {"thesis.tex": b"years of work"}


def test_a_failing_check_of_the_output_keeps_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export(load("diff_bot"), tmp_path / "out")
    before = everything(tmp_path / "out")
    import twin.convert.export as module

    def rounded(spec: mujoco.MjSpec) -> str:
        spec.compile()
        return spec.to_xml().replace('mass="1"', 'mass="1.001"')

    monkeypatch.setattr(module, "exact_xml", rounded)
    with pytest.raises(ConversionError, match="the model differs from the file"):
        export(load("diff_bot"), tmp_path / "out")
    assert everything(tmp_path / "out") == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


Change = Callable[[mujoco.MjSpec], None]


def heavier(spec: mujoco.MjSpec) -> None:
    spec.body("mast").mass *= 1.0 + 1e-6


def shifted(spec: mujoco.MjSpec) -> None:
    spec.body("wrist").pos += [0.0, 0.0, 1e-6]


def tilted(spec: mujoco.MjSpec) -> None:
    spec.joint("wrist_yaw_joint").axis = [1e-3, 0.0, 1.0]


@pytest.mark.parametrize(
    ("change", "part"), [(heavier, "mass"), (shifted, "kinematics"), (tilted, "mass_matrix")]
)
def test_the_self_check_notices_a_wrong_model(change: Change, part: str) -> None:
    conversion = convert(load("warehouse_bot"))
    spec = conversion.spec.copy()
    assert self_check(spec.compile(), conversion.description).passed
    change(spec)
    checked = self_check(spec.compile(), conversion.description)
    assert not checked.passed
    assert getattr(checked, part) > checked.tolerance


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_ledger_has_every_tag(robot: str) -> None:
    description = load(robot)
    entries = tag_ledger(description, roles_of(description))
    tags = [element.tag for element in etree.fromstring(description.urdf).iter(tag=etree.Element)]
    assert len(entries) == len(tags)
    assert [re.sub(r"^.*/| .*$", "", entry.element) for entry in entries] == tags


LEDGER: dict[str, tuple[str, str]] = {
    "link 'base'": ("kept", "body"),
    "link 'base'/collision/geometry/box": ("kept", "geom"),
    "link 'wheel'/collision/geometry/cylinder": ("translated", "ellipsoid"),
    "link 'wheel'/inertial/inertia": ("translated", "nearest inertia"),
    "joint 'j'/axis": ("translated", "unit vector"),
    "joint 'j'/limit": ("translated", "no range: a continuous joint has none; actuatorfrcrange; velocity"),
    "joint 'j'/safety_controller": ("dropped", "controller"),
    "joint 'f'/axis": ("dropped", "a fixed joint has none"),
    "link 'base'/collision/contact_coefficients": ("dropped", "no counterpart"),
    "link 'base'/collision/origin": ("kept", "pose"),
    "gazebo 'wheel'/mu1": ("kept", "friction 0.5"),
    "gazebo 'wheel'/mu2": ("kept", "same in every direction"),
    "gazebo 'wheel'/kp": ("dropped", "not in N/m"),
    "gazebo/plugin": ("translated", "velocity actuators"),
    "gazebo/plugin/left_joint": ("translated", "actuator"),
    "gazebo/plugin/wheel_radius": ("dropped", "drive controller"),
    "sensor 'eye'": ("dropped", "not simulated"),
    "transmission": ("dropped", "names 0 joints"),
    "transmission/type": ("dropped", "names 0 joints"),
    "material": ("dropped", "nothing uses it"),
}


def test_the_ledger_tells_the_fate_of_each_tag(tmp_path: Path) -> None:
    thin = "<inertia ixx='1' iyy='1' izz='2.001'/>"
    description = saved(
        tmp_path / "src",
        f"<link name='base'>{INERTIAL}<collision><origin/><geometry><box size='1 1 1'/></geometry>"
        "<contact_coefficients mu='0'/></collision></link>"
        f"<link name='wheel'><inertial><mass value='1'/>{thin}</inertial>"
        "<collision><geometry><cylinder radius='1' length='0.1'/></geometry></collision></link>"
        "<link name='c'/>"
        "<joint name='j' type='continuous'><parent link='base'/><child link='wheel'/><axis xyz='0 2 0'/>"
        "<limit lower='0' upper='1' effort='1' velocity='2'/><safety_controller k_velocity='1'/></joint>"
        "<link name='d'/><joint name='g' type='continuous'><parent link='base'/><child link='d'/></joint>"
        "<joint name='f' type='fixed'><parent link='base'/><child link='c'/><axis xyz='0 0 1'/></joint>"
        "<gazebo reference='wheel'><mu1>0.5</mu1><mu2>0.5</mu2><kp>1</kp>"
        "<sensor name='eye' type='camera'/></gazebo>"
        "<gazebo><plugin filename='gz-sim-diff-drive-system'>"
        "<left_joint>j</left_joint><right_joint>g</right_joint>"
        "<wheel_separation>1</wheel_separation><wheel_radius>1</wheel_radius></plugin></gazebo>"
        "<transmission><type>SimpleTransmission</type></transmission>"
        "<material name='m'><color rgba='1 1 1 1'/></material>",
    )  # fmt: skip
    entries = {entry.element: entry for entry in tag_ledger(description, roles_of(description))}
    for element, (outcome, note) in LEDGER.items():
        assert entries[element].outcome == outcome, (element, entries[element])
        assert note in entries[element].note, (element, entries[element])
        assert entries[element].line == 2


def test_the_report_is_complete(tmp_path: Path) -> None:
    export(load("warehouse_bot"), tmp_path / "out")
    report: dict[str, Any] = json.loads((tmp_path / "out" / "report.json").read_text("utf-8"))
    assert report["mass"] == pytest.approx(78.3)
    assert [link["name"] for link in report["links"]] == list(load("warehouse_bot").links)
    assert {joint["name"]: joint["type"] for joint in report["joints"]}["lift_joint"] == "prismatic"
    assert "wheel_left_joint" in report["actuators"]
    assert sum(report["tags"].values()) == len(report["ledger"])
    assert all(guess.keys() == {"element", "note"} for guess in report["guesses"])
    assert report["guesses"]


def test_a_root_named_world_is_in_the_ledger(tmp_path: Path) -> None:
    joint = "<joint name='j' type='continuous'><parent link='world'/><child link='b'/></joint>"
    description = saved(tmp_path / "src", f"<link name='world'/><link name='b'>{INERTIAL}</link>{joint}")
    assert [d.code for d in check(description)] == []
    report = export(description, tmp_path / "out")
    entry = next(entry for entry in report["ledger"] if entry["element"] == "link 'world'")
    assert not any(guess["element"].startswith("base") for guess in report["guesses"]), "the file says it"
    assert (report["base"], entry["outcome"]) == ("fixed", "translated")


def test_shapes_inside_of_each_other_and_rubbing_wheels(tmp_path: Path) -> None:
    def ball(x: float) -> str:
        return f"<collision><origin xyz='{x} 0 0'/><geometry><sphere radius='0.1'/></geometry></collision>"

    chain = (
        f"<link name='a'>{INERTIAL}{ball(0)}</link>\n<link name='b'>{INERTIAL}</link>\n"
        f"<link name='c'>{INERTIAL}{ball(0.15)}</link>\n"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
        "<joint name='k' type='continuous'><parent link='b'/><child link='c'/></joint>"
    )
    description = saved(tmp_path / "src", chain)
    found = [d for d in inspect_file(description.source).diagnostics if d.code == "overlap"]
    assert [(d.element, d.line) for d in found] == [("link 'c'", 4)]
    assert "'a' and 'c' are 0.05 m inside" in found[0].message
    apart = saved(tmp_path / "src", chain.replace("0.15 0 0", "0.21 0 0"))
    assert not [d for d in inspect_file(apart.source).diagnostics if d.code == "overlap"]


def test_a_mesh_that_mujoco_cannot_read_is_a_diagnostic(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "arm.dae").write_text("<COLLADA/>", encoding="utf-8")
    mesh = "<visual><geometry><mesh filename='arm.dae'/></geometry></visual>"
    description = saved(tmp_path / "src", f"<link name='a'>{INERTIAL}{mesh}</link>")
    found = inspect_file(description.source)
    assert [(d.code, d.element) for d in found.diagnostics if d.severity == "error"] == [
        ("mesh-format", "link 'a'")
    ]
    assert replace(found, diagnostics=()).count("error") == 0
