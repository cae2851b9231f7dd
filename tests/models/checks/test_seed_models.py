"""The tutorials' files: every defect that can be seen in the file itself is named.

Not in the files, and so not named: what the tutorials' prose says of wheels and axes, that the launch file
passes a path as robot_description, and that a publisher leaves the periscope's range.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.convert.inspection import inspect_file

SEEDS = Path(__file__).parents[4] / "shared" / "seed_models"

R2D2 = ("axis", "leg1", "leg2", "body", "head", "rod", "box")
DEFECTS = {
    "simple_robot.urdf.xacro": {
        "wheel-axis": ("link 'wheel_left'", "link 'wheel_right'"),
        "wheel-rubs": ("link 'wheel_left'", "link 'wheel_right'"),
        "missing-drive": ("robot",),
        "base-on-ground": ("link 'base_link'",),
        "few-supports": ("robot",),
        "inertia-placeholder": ("link 'base_link'", "link 'wheel_left'", "link 'wheel_right'"),
        "no-effort": ("joint 'wheel_left_joint'", "joint 'wheel_right_joint'"),
        "no-velocity": ("joint 'wheel_left_joint'", "joint 'wheel_right_joint'"),
    },
    "r2d2.urdf": {
        "inertia-too-large": tuple(f"link '{name}'" for name in R2D2),
        "material-elsewhere": ("link 'body'", "link 'head'", "link 'rod'"),
        "ignored-tag": ("link 'axis'",),
        "visual-collision": ("link 'body'", "link 'rod'"),
        "overlap": ("link 'head'", "link 'head'", "link 'head'", "link 'rod'", "link 'box'"),
        "rounded-angle": ("link 'axis'",),
        "weak-motor": ("joint 'periscope'",),
    },
    "sp1s_1.urdf": {"massless-base": ("link 'base_link'",), "no-collision": ("link 'base_link'",)},
    "sp1s_2.urdf": {
        "massless-base": ("link 'base_link'",),
        "no-collision": ("link 'base_link'",),
        "wheel-fixed": ("joint 'base_to_front_left'",),
    },
    "test_robot_1.urdf": {
        "massless-base": ("link 'link1'",),
        "massless": ("link 'link2'", "link 'link3'", "link 'link4'"),
    },
    "test_robot_2.urdf": {
        "massless-base": ("link 'link1'",),
        "massless": ("link 'link2'", "link 'link3'", "link 'link4'"),
        "rounded-angle": ("joint 'joint2'", "joint 'joint3'"),
    },
    "test_robot_3.urdf": {
        "massless-base": ("link 'link1'",),
        "massless": ("link 'link2'", "link 'link3'", "link 'link4'"),
        "rounded-angle": ("joint 'joint2'", "joint 'joint3'"),
        "axis-length": ("joint 'joint1'",),
    },
}
"""Elements by code, the whole output; the source is shared/facts/conversion.md, section 2."""

NUMBERS = {
    "simple_robot.urdf.xacro": ("90.0 degrees", "z = -0.05 m", "2.40 times", "only 2 on the ground"),
    "r2d2.urdf": (
        "needs mass 10 m from the axis",
        "0.31 m inside of each other",
        "0.15 m inside of each other",
        "10 N, gravity pulls with 19.6 N",
        "0 0 -0.2, its collision around 0 0 0.2",
        "mu=0, so without any friction",
    ),
    "sp1s_2.urdf": ("fixed to 'base_link' at its centre",),
    "test_robot_3.urdf": ("length 0.912, not 1",),
}

pytestmark = pytest.mark.skipif(
    not SEEDS.is_dir(), reason="the tutorials' files are not beside this checkout"
)


@pytest.mark.parametrize("name", DEFECTS)
def test_every_defect_is_named_and_nothing_else(name: str) -> None:
    found: dict[str, list[str]] = {}
    for diagnostic in inspect_file(SEEDS / name).diagnostics:
        found.setdefault(diagnostic.code, []).append(diagnostic.element)
    assert {code: tuple(elements) for code, elements in found.items()} == DEFECTS[name]


@pytest.mark.parametrize("name", NUMBERS)
def test_the_numbers_are_those_measured(name: str) -> None:
    messages = "\n".join(diagnostic.message for diagnostic in inspect_file(SEEDS / name).diagnostics)
    assert [number for number in NUMBERS[name] if number not in messages] == []


def test_a_xacro_file_without_xacro_keeps_its_lines() -> None:
    found = inspect_file(SEEDS / "simple_robot.urdf.xacro").diagnostics
    lines = (SEEDS / "simple_robot.urdf.xacro").read_text("utf-8").splitlines()
    starts = {"wheel-axis": "<collision>", "inertia-placeholder": "<inertial>", "no-effort": "<joint name="}
    checked = 0
    for diagnostic in found:
        assert diagnostic.line is not None
        if diagnostic.code in starts:
            assert lines[diagnostic.line - 1].startswith(starts[diagnostic.code])
            checked += 1
    assert checked == 7
