"""Each check finds its fault, names it with line and number, and is silent about a sound robot."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from twin.models.checks import ERRORS, WARNINGS, Diagnostic, check
from twin.models.loader import parse_urdf

SOURCES = Path(__file__).parents[3] / "twin"

WHEEL_SHAPE = "<origin rpy='1.5707963 0 0'/><geometry><cylinder radius='0.05' length='0.02'/></geometry>"
WHEEL_INERTIAL = (
    "<inertial><origin rpy='1.5707963 0 0'/><mass value='0.1'/>"
    "<inertia ixx='6.6e-5' iyy='6.6e-5' izz='1.25e-4'/></inertial>"
)
BALL = "<geometry><sphere radius='0.02'/></geometry>"
BOX = "<geometry><box size='0.1 0.1 0.1'/></geometry>"
CUBE = (
    "<inertial><mass value='0.6'/><inertia ixx='0.001' iyy='0.001' izz='0.001'/></inertial>"
    f"<visual>{BOX}</visual><collision>{BOX}</collision>"
)


def wheel(side: str, y: str, shape: str = WHEEL_SHAPE, inertial: str = WHEEL_INERTIAL) -> list[str]:
    """Return two lines: the link and its joint."""
    return [
        f"<link name='{side}'>{inertial}<visual>{shape}</visual><collision>{shape}</collision></link>",
        f"<joint name='{side}_joint' type='continuous'><origin xyz='0 {y} 0'/><parent link='base'/>"
        f"<child link='{side}'/><axis xyz='0 1 0'/><limit effort='2' velocity='9'/></joint>",
    ]


def cart(**changes: str) -> str:
    """Return a sound robot with two wheels and a caster; changes replace lines by their name."""
    box = "<geometry><box size='0.3 0.2 0.06'/></geometry>"
    inertia = "<inertia ixx='0.0036' iyy='0.0078' izz='0.0108'/>"
    left, left_joint = wheel("left", "0.15")
    right, right_joint = wheel("right", "-0.15")
    lines = {
        "robot": "<robot name='cart'>",
        "base": f"<link name='base'><inertial><mass value='1'/>{inertia}</inertial>"
        f"<visual>{box}</visual><collision>{box}</collision></link>",
        "left": left,
        "left_joint": left_joint,
        "right": right,
        "right_joint": right_joint,
        "caster": f"<link name='caster'><visual>{BALL}</visual><collision>{BALL}</collision></link>",
        "caster_joint": "<joint name='caster_joint' type='fixed'><origin xyz='0.12 0 -0.03'/>"
        "<parent link='base'/><child link='caster'/></joint>",
        "extra": PLUGIN.format(0.3, 0.05),
        "end": "</robot>",
    }
    return "\n".join((lines | changes).values())


def arm(joint: str, link: str = CUBE, kind: str = "revolute", origin: str = "xyz='0 0 1'") -> str:
    """Return a base with one link on one joint, which is in line 3."""
    return (
        f"<robot name='arm'>\n<link name='base'>{CUBE}</link>\n"
        f"<joint name='j' type='{kind}'><origin {origin}/>"
        f"<parent link='base'/><child link='tip'/>{joint}</joint>\n"
        f"<link name='tip'>{link}</link>\n</robot>"
    )


LIMIT = "<limit lower='-1' upper='1' effort='9' velocity='1'/>"
AXIS = "<axis xyz='0 0 1'/>"
TUMBLING = wheel("left", "0.15", WHEEL_SHAPE.replace("1.5707963", "0"))[0]
FIXED_WHEEL = wheel("left", "0.15")[1].replace("continuous", "fixed")
HEAVY = WHEEL_INERTIAL.replace("6.6e-5", "6.6e-2").replace("1.25e-4", "1.25e-2")
LIGHT = WHEEL_INERTIAL.replace("6.6e-5", "6.6e-7").replace("1.25e-4", "1.25e-6")
ALIKE = WHEEL_INERTIAL.replace("6.6e-5", "1e-4").replace("1.25e-4", "1e-4")
RAISED = CUBE.replace("<collision>", "<collision><origin xyz='0 0 0.05'/>")
RED = "<visual><geometry><sphere radius='0.1'/></geometry><material name='red'>{}</material></visual>"
PLUGIN = (
    "<gazebo><plugin name='gz::sim::systems::DiffDrive'><left_joint>left_joint</left_joint>"
    "<right_joint>right_joint</right_joint><wheel_separation>{}</wheel_separation>"
    "<wheel_radius>{}</wheel_radius></plugin></gazebo>"
)
COLOR = "<color rgba='1 0 0 1'/>"

TRINKET = (
    "<link name='eye'><inertial><mass value='0.1'/><inertia ixx='1e-4' iyy='1e-4' izz='1e-3'/>"
    "</inertial></link>"
    "<joint name='f' type='fixed'><parent link='tip'/><child link='eye'/></joint></robot>"
)

FOUND = {
    "wheel-axis": (cart(left=TUMBLING), 3, "90.0 degrees off the axis of joint 'left_joint'"),
    "wheel-fixed": (
        cart(extra="", left_joint=FIXED_WHEEL).replace("'left'", "'wheel'"),
        4,
        "to 'base' at 0 0.15 0 m",
    ),
    "drive-mismatch": (
        cart(extra=PLUGIN.format(0.3, 0.06)),
        9,
        "says wheel_radius 0.06 m, the collision shape of 'left' has 0.05 m",
    ),
    "missing-drive": (
        cart(extra=""),
        4,
        "takes it for diff_drive with 'left_joint' left, 'right_joint' right",
    ),
    "base-on-ground": (cart().replace("0.3 0.2 0.06", "0.3 0.2 0.1"), 2, "it ends at z = -0.05 m"),
    "wheels-off-ground": (cart().replace("0 -0.03", "0 -0.04"), 7, "10 mm lower"),
    "few-supports": (cart().replace("0 -0.03", "0 -0.01"), 2, "only 2 on the ground"),
    "visual-collision": (arm(AXIS + LIMIT, RAISED), 4, "0.05 m apart"),
    "inertia-too-large": (cart(left=wheel("left", "0", inertial=HEAVY)[0]), 3, "0.812 m from the axis"),
    "inertia-too-small": (cart(left=wheel("left", "0", inertial=LIGHT)[0]), 3, "0.01 times"),
    "undefined-material": (arm(AXIS + LIMIT, CUBE + RED.format("")), 4, "'red' of link 'tip' is not defined"),
    "idle-mimic": (arm(AXIS + LIMIT + "<mimic joint='q'/>"), 3, "mimics 'q', which does not exist"),
    "lumped-inertia": (arm(AXIS + LIMIT).replace("</robot>", TRINKET), 5, "0.0001, 0.0001, 0.001 kg m²"),
    "repaired-inertia": (arm(AXIS + LIMIT, CUBE.replace("izz='0.001'", "izz='0.0020005'")), 4, "or rounded"),
    "inertia-placeholder": (cart(left=wheel("left", "0", inertial=ALIKE)[0]), 3, "0.80 to 1.52 times"),
    "massless": (arm(AXIS + LIMIT, ""), 4, "weighs nothing"),
    "massless-base": (arm(AXIS + LIMIT).replace(f"'base'>{CUBE}", "'base'>"), 2, "'base' weighs nothing"),
    "no-collision": (arm(AXIS + LIMIT, CUBE.partition("<collision>")[0]), 4, "not touched"),
    "limits-exclude-zero": (arm(AXIS + LIMIT.replace("-1", "0.5")), 3, "range 0.5 … 1 rad leaves out 0"),
    "no-range": (arm(AXIS + "<limit effort='9' velocity='1'/>"), 3, "are both 0 rad"),
    "no-effort": (arm(AXIS + LIMIT.replace("9", "0")), 3, "effort limit is 0"),
    "no-velocity": (arm(AXIS + LIMIT.replace("velocity='1'", "")), 3, "velocity limit is missing"),
    "weak-motor": (arm(AXIS + LIMIT.replace("9", "5"), kind="prismatic"), 3, "gravity pulls with 5.89 N"),
    "axis-length": (arm("<axis xyz='0 0.6 0.6'/>" + LIMIT), 3, "length 0.849, not 1"),
    "rounded-angle": (arm(AXIS + LIMIT, origin="rpy='0 3.14 0'"), 3, "3.14 is 0.091 degrees off 180 degrees"),
    "material-elsewhere": (
        arm(AXIS + LIMIT, CUBE + RED.format("")).replace("'base'>", f"'base'>{RED.format(COLOR)}"),
        4,
        "'red' is defined in link 'base' (line 2)",
    ),
    "ignored-tag": (arm(AXIS + LIMIT + "<limits/>"), 3, "<limits> in <joint> is not URDF"),
    "ignored-attribute": (arm(AXIS + LIMIT.replace("/>", " uper='3'/>")), 3, "<limit uper='…'> is not URDF"),
    "repeated-tag": (arm(AXIS + AXIS + LIMIT), 3, "<axis> stands here twice"),
    "not-simulated": (
        cart(extra="<gazebo><plugin filename='libgazebo_ros_planar_move.so' name='p'/></gazebo>"),
        9,
        "plugin 'gazebo_ros_planar_move' is not simulated",
    ),
    "unknown-reference": (cart(extra="<gazebo reference='bas'/>"), 9, "extends 'bas', which is neither"),
    "ignored-value": (cart(extra="<gazebo reference='base'><mu1/></gazebo>"), 9, "<mu1> of 'base' is ''"),
    "several-interfaces": (
        cart(
            extra="<ros2_control><joint name='left_joint'><command_interface name='velocity'/>"
            "<command_interface name='effort'/></joint></ros2_control>"
        ),
        9,
        "interfaces velocity, effort; velocity counts",
    ),
    "camera-frame": (
        cart(extra="<gazebo reference='base'><sensor name='c' type='camera'><camera/></sensor></gazebo>")
        .replace("'base'", "'optical_base'"),
        9,
        "looks along +x of 'optical_base'",
    ),
}  # fmt: skip

MORE = {
    "massless, with what is fixed to it": (
        arm(AXIS + LIMIT, "").replace(
            "</robot>",
            "<link name='lamp'/><joint name='l' type='fixed'><parent link='tip'/><child link='lamp'/></joint>"
            "</robot>",
        ),
        4,
        "",
    ),
    "two without collision": (
        arm(AXIS + LIMIT, CUBE.partition("<collision>")[0]).replace(
            "</robot>",
            f"<link name='lamp'><visual>{BOX}</visual></link><joint name='l' type='fixed'>"
            "<parent link='tip'/><child link='lamp'/></joint></robot>",
        ),
        4,
        "",
    ),
    "two faults in gazebo tags": (
        cart(extra="<gazebo reference='bas'/><gazebo><plugin name='w' filename='wind'/></gazebo>"),
        9,
        "",
    ),
}
"""Further ones, of which every word is compared."""
BY_COLLISION_DETECTION = {"overlap", "wheel-rubs"}
"""Tested with the conversion, where MuJoCo is."""
BY_OPTION = {"skipped-mesh", "turned-mesh"}
"""Tested with the meshes."""


def diagnose(text: str) -> tuple[Diagnostic, ...]:
    return check(parse_urdf(text, Path("r.urdf")))


def test_every_warning_has_a_case() -> None:
    assert set(FOUND) - set(ERRORS) == set(WARNINGS) - BY_COLLISION_DETECTION - BY_OPTION


@pytest.mark.parametrize("code", FOUND)
def test_fault_is_found_with_line_and_number(code: str) -> None:
    text, line, message = FOUND[code]
    found = [diagnostic for diagnostic in diagnose(text) if diagnostic.code == code]
    assert found, [diagnostic.code for diagnostic in diagnose(text)]
    assert (found[0].line, found[0].file, found[0].severity) == (
        line,
        Path("r.urdf"),
        "warning" if code in WARNINGS else "error",
    )
    assert message in found[0].message
    assert found[0].fix


def test_findings_read_as_they_did() -> None:
    """What a user is told of each faulty robot, all of it; a person read each line."""
    told = [
        f"{code}: {found.line} {found.severity} {found.code} {found.element}: {found.message} | {found.fix}"
        for code, (text, _, _) in (FOUND | MORE).items()
        for found in diagnose(text)
    ]
    assert told == Path(__file__).with_name("findings.txt").read_text("utf-8").splitlines()


def test_sound_robots_are_left_in_peace() -> None:
    assert diagnose(cart()) == ()
    assert diagnose(arm(AXIS + LIMIT)) == ()


def test_a_robot_that_another_plugin_moves_is_taken_for_nothing() -> None:
    text = cart(extra="<gazebo><plugin name='p' filename='libgazebo_ros_planar_move.so'/></gazebo>")
    (found,) = (diagnostic for diagnostic in diagnose(text) if diagnostic.code == "missing-drive")
    assert found.line == 9
    assert found.message == "the plugin 'gazebo_ros_planar_move', which moves it, is not simulated"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (cart(extra=PLUGIN.format(0.34, 0.05)), "says wheel_separation 0.34 m, the wheels are 0.3 m apart"),
        (
            cart(extra=PLUGIN.format(0.3, 0.05).replace("left_joint>left", "left_joint>xx"))
            .replace("left_joint>xx_joint", "left_joint>right_joint")
            .replace("<right_joint>right_joint", "<right_joint>left_joint"),
            "left wheels are 0.3 m to the right of its right wheels",
        ),
        (
            cart(
                extra=PLUGIN.format(0.3, 0.05),
                right_joint=wheel("right", "-0.15")[1].replace("0 1 0", "0 -1 0"),
            ),
            "the axis of wheel joint 'right_joint' points to the right",
        ),
    ],
)
def test_a_drive_at_odds_with_its_wheels_is_named(text: str, message: str) -> None:
    found = [diagnostic.message for diagnostic in diagnose(text) if diagnostic.code == "drive-mismatch"]
    assert len(found) == 1
    assert message in found[0]


def test_a_drive_that_is_its_wheels_is_left_in_peace() -> None:
    assert [d.code for d in diagnose(cart(extra=PLUGIN.format(0.3, 0.05)))] == []


def test_a_shape_may_be_touched_in_part_only() -> None:
    half = CUBE.replace("<collision>", "<collision><origin xyz='0 0 0.025'/>").replace(
        f"{BOX}</collision>", "<geometry><box size='0.1 0.1 0.05'/></geometry></collision>"
    )
    assert diagnose(arm(AXIS + LIMIT, half)) == ()


def test_the_fix_of_a_tumbling_wheel_mends_it() -> None:
    (found,) = (diagnostic for diagnostic in diagnose(cart(left=TUMBLING)) if diagnostic.code == "wheel-axis")
    rpy = re.search(r"rpy='(.*?)'", found.fix)
    assert rpy
    mended = wheel("left", "0.15", WHEEL_SHAPE.replace("1.5707963 0 0", rpy[1]))[0]
    assert diagnose(cart(left=mended)) == ()


def test_the_fix_of_an_inertia_mends_it() -> None:
    text = FOUND["inertia-too-large"][0]
    (found,) = (diagnostic for diagnostic in diagnose(text) if diagnostic.code == "inertia-too-large")
    inertia = found.fix.removeprefix("a homogeneous body has ")
    assert diagnose(text.replace("<inertia ixx='6.6e-2' iyy='6.6e-2' izz='1.25e-2'/>", inertia)) == ()


def test_a_lying_arm_is_judged_at_its_worst_angle() -> None:
    """0.6 kg on 0.5 m: 2.94 Nm when it lies, though at joint position zero it hangs straight down."""
    link = CUBE.replace("<inertial>", "<inertial><origin xyz='0 0 -0.5'/>").replace("0.001", "0.002")
    hanging = "<axis xyz='0 1 0'/><limit lower='{}' upper='{}' effort='2.9' velocity='1'/>"

    def loads(lower: float, upper: float) -> list[str]:
        found = diagnose(arm(hanging.format(lower, upper), link))
        return [diagnostic.message for diagnostic in found if diagnostic.code == "weak-motor"]

    assert loads(-0.5, 0.5) == []
    assert "gravity pulls with 2.94 Nm" in loads(-0.5, 2.0)[0]
    assert "gravity pulls with 2.94 Nm" in loads(-3.0, -0.5)[0]


def test_a_follower_loads_its_leader() -> None:
    stage = (
        f"<link name='b'>{CUBE}</link><joint name='k' type='prismatic'><parent link='tip'/><child link='b'/>"
    )
    stage += f"{AXIS}{LIMIT}<mimic joint='j' multiplier='2'/></joint></robot>"
    text = arm(AXIS + LIMIT.replace("9", "20"), kind="prismatic").replace("</robot>", stage)
    (found,) = (diagnostic for diagnostic in diagnose(text) if diagnostic.code == "weak-motor")
    assert "23.5 N" in found.message  # 2 links on the leader, 1 link twice as fast: (2 + 2) * 0.6 kg * g


def test_all_codes_of_the_loader_and_the_converter_are_registered() -> None:
    used: set[str] = set()
    for package in ("models", "convert"):
        for file in sorted((SOURCES / package).rglob("*.py")):
            used |= set(re.findall(r"code=\"([a-z-]+)\"", file.read_text("utf-8")))
    assert used <= {*ERRORS, *WARNINGS}
    assert set(ERRORS) - used == set(), "codes that nothing uses"


def test_every_code_is_documented_with_its_meaning() -> None:
    page = (SOURCES.parent / "docs" / "checking.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `([a-z-]+)` \| (.*) \|$", page, re.MULTILINE))
    assert rows == {**WARNINGS, **ERRORS}
