"""Massless links that move: taken where what they carry has mass, refused by name where not."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from twin.convert import convert
from twin.convert.export import export
from twin.errors import ConversionError
from twin.models import load
from twin.models.loader import parse_urdf

INERTIAL = "<inertial><mass value='1'/><inertia ixx='0.1' iyy='0.1' izz='0.1'/></inertial>"


def robot(first: str, second: str, end: str = INERTIAL) -> str:
    """Return base - massless link - end, on hinges about these axes, in lines 2, 4 and 6."""
    hinge = (
        "<joint name='{0}' type='continuous'><parent link='{1}'/><child link='{2}'/><axis xyz='{3}'/></joint>"
    )
    return "\n".join(
        [
            "<robot name='r'>",
            f"<link name='base'>{INERTIAL}</link>",
            hinge.format("roll", "base", "cross", first),
            "<link name='cross'/>",
            hinge.format("pitch", "cross", "end", second),
            f"<link name='end'>{end}</link>",
            "</robot>",
        ]
    )


def test_a_universal_joint_swings_as_one_of_two_hinges_in_one_body() -> None:
    """MuJoCo has both hinges in one body without any link between: the oracle."""
    text = robot("1 0 0", "0 1 0", INERTIAL.replace("<mass", "<origin xyz='0 0 -0.3'/><mass"))
    spec = convert(parse_urdf(text, Path("r.urdf")), base="fixed").spec
    oracle = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><body><joint axis="1 0 0"/><joint axis="0 1 0"/>
        <inertial pos="0 0 -0.3" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"""
    )
    states = []
    for model in (spec.compile(), oracle):
        data = mujoco.MjData(model)
        data.qpos[:] = 0.4, -0.3
        mujoco.mj_step(model, data, 500)
        states.append(data.qpos.copy())
    np.testing.assert_allclose(*states, atol=1e-9)


def test_what_is_written_has_the_trifle_too(tmp_path: Path) -> None:
    """MuJoCo writes masses below 1e-12 kg as 0, and then refuses them."""
    (tmp_path / "r.urdf").write_text(robot("1 0 0", "0 1 0"), encoding="utf-8")
    report = export(load(tmp_path / "r.urdf"), tmp_path / "out", base="fixed")
    assert report["self_check"]["passed"]
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml")).body("cross").mass[0] > 0.0


def test_nothing_to_carry_is_refused() -> None:
    with pytest.raises(ConversionError, match=r"r\.urdf:6: link 'end' moves and has no mass"):
        convert(parse_urdf(robot("1 0 0", "0 1 0", ""), Path("r.urdf")))


@pytest.mark.filterwarnings("error")
def test_two_hinges_that_cancel_each_other_are_refused() -> None:
    innocent = (
        f"<joint name='nod' type='continuous'><parent link='end'/><child link='head'/></joint>"
        f"<link name='head'>{INERTIAL}</link></robot>"
    )
    text = robot("0 0 1", "0 0 1").replace("</robot>", innocent)
    with pytest.raises(
        ConversionError, match="'cross' has no mass, and joints roll, pitch can turn"
    ) as caught:
        convert(parse_urdf(text, Path("r.urdf")))
    assert caught.value.problems[0].line == 4


def test_a_follower_of_a_fixed_joint_stands_still() -> None:
    text = robot("1 0 0", "0 1 0").replace("name='roll' type='continuous'", "name='roll' type='fixed'")
    text = text.replace("<axis xyz='0 1 0'/>", "<axis xyz='0 1 0'/><mimic joint='roll' offset='0.5'/>")
    model = convert(parse_urdf(text, Path("r.urdf")), base="fixed").spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    assert data.joint("pitch").qpos[0] == pytest.approx(0.5, abs=1e-3)
