"""Robots of the catalogue and carts of any size go where closed-form kinematics says; bad ones do not."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from twin.controllers.drive_config import analytic_track_ratio, drive_config
from twin.convert import convert
from twin.errors import SimulationError
from twin.geometry import Pose2
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.loader import parse_urdf
from twin.models.specs import CommandSpec
from twin.sim import drive_check
from twin.sim.drive_check import (
    DriveReport,
    _check,
    _circle_bar,
    calibrated_track_ratio,
    check_drive,
    drive_self_check,
)
from twin.sim.driving import ProvingGround
from twin.sim.physics import Physics

SEED = Path(__file__).parents[3] / "shared" / "seed_models" / "simple_robot.urdf.xacro"


def cart(
    mass: float,
    radius: float,
    track: float,
    axles: tuple[float, ...] = (0.0,),
    *,
    caster_mu: str = "<mu1>0</mu1>",
    effort: float = 1e3,
    friction: float = 0.0,
    behind: float = 0.05,
) -> RobotDescription:
    """Return a box on wheels, one pair for each axle at x; with one axle, two ball casters as well.

    Its centre of mass is `behind` times its length behind the middle.
    """
    wheel_mass, width = mass / 50.0, 0.3 * radius
    body = mass - 2 * len(axles) * wheel_mass
    length, breadth, height = 2 * max(axles) + 4 * radius, 0.7 * track, 2 * radius
    ixx, iyy, izz = (
        body * (p**2 + q**2) / 12 for p, q in ((breadth, height), (length, height), (length, breadth))
    )
    centre = 0.4 * radius
    text = (
        f"<robot name='cart'><link name='base'><inertial><origin xyz='{-behind * length} 0 {centre}'/>"
        f"<mass value='{body}'/><inertia ixx='{ixx}' iyy='{iyy}' izz='{izz}'/></inertial>"
        f"<collision><origin xyz='0 0 {centre}'/><geometry>"
        f"<box size='{length} {breadth} {height}'/></geometry></collision></link>"
    )
    moment = wheel_mass * radius**2 / 2
    for i, x in enumerate(axles):
        for side, y in (("left", track / 2), ("right", -track / 2)):
            text += (
                f"<link name='{side}{i}'><inertial><mass value='{wheel_mass}'/>"
                f"<inertia ixx='{0.6 * moment}' iyy='{moment}' izz='{0.6 * moment}'/></inertial><collision>"
                f"<origin rpy='{math.pi / 2} 0 0'/><geometry><cylinder radius='{radius}' length='{width}'/>"
                f"</geometry></collision></link><joint name='{side}{i}_joint' type='continuous'>"
                f"<origin xyz='{x} {y} 0'/><parent link='base'/><child link='{side}{i}'/><axis xyz='0 1 0'/>"
                f"<limit effort='{effort}' velocity='100'/><dynamics friction='{friction}'/></joint>"
            )
    for name, x in (("front", 0.4 * length), ("back", -0.4 * length)) if len(axles) == 1 else ():
        ball = 0.2 * radius
        text += (
            f"<link name='caster_{name}'><collision><geometry><sphere radius='{ball}'/></geometry>"
            f"</collision></link><joint name='caster_{name}_joint' type='fixed'>"
            f"<origin xyz='{x} 0 {ball - radius}'/>"
            f"<parent link='base'/><child link='caster_{name}'/></joint>"
            f"<gazebo reference='caster_{name}'>{caster_mu}</gazebo>"
        )
    joints = "".join(
        f"<{side}_joint>{side}{i}_joint</{side}_joint>"
        for side in ("left", "right")
        for i in range(len(axles))
    )
    text += (
        f"<gazebo><plugin name='gz::sim::systems::DiffDrive'>{joints}<wheel_separation>{track}"
        f"</wheel_separation><wheel_radius>{radius}</wheel_radius></plugin></gazebo></robot>"
    )
    return parse_urdf(text, Path("cart.urdf"))


def flipped(description: RobotDescription, name: str) -> RobotDescription:
    x, y, z = description.joints[name].axis
    joint = replace(description.joints[name], axis=(-x, -y, -z))
    return replace(description, joints={**description.joints, name: joint})


def missed(report: DriveReport) -> dict[str, str]:
    return {item.name: item.words for item in report.manoeuvres if not item.passed}


@pytest.mark.parametrize("robot", ["diff_bot", "sp1s", "warehouse_bot"])
def test_the_catalogue_drives_true(robot: str) -> None:
    report = check_drive(load(robot))
    assert missed(report) == {}
    bars = {item.name.split()[0]: item.bar for item in report.manoeuvres}
    # As the table in docs/checking.md has it.
    assert bars == {"straight": 0.005, "spin": 0.3, "circle": 0.5, "stand": 0.005}


@pytest.mark.parametrize(
    ("robot", "timestep"),
    [
        (cart(1.0, 0.03, 0.2), 0.002),
        (cart(30.0, 0.1, 0.5), 0.002),
        (cart(30.0, 0.1, 0.5), 0.005),
        (cart(200.0, 0.2, 0.8), 0.002),
        (cart(5.0, 0.05, 0.3, caster_mu="", friction=0.02), 0.002),
        (cart(1.0, 0.03, 0.16, (0.06, -0.06), behind=0.0), 0.002),
        (cart(30.0, 0.1, 0.5, (0.2, -0.2), behind=0.0), 0.002),
        (cart(200.0, 0.2, 0.8, (0.3, -0.3), behind=0.0), 0.005),
    ],
    ids=["1kg", "30kg", "30kg-5ms", "200kg", "casters-without-mu", "4x4-1kg", "4x4-30kg", "4x4-200kg-5ms"],
)
def test_carts_of_any_size_drive_true(robot: RobotDescription, timestep: float) -> None:
    assert missed(check_drive(robot, timestep=timestep)) == {}


def test_wheels_of_meshes_drive_true_too(tmp_path: Path) -> None:
    """As polygons of 40 corners they missed the straight by centimetres."""
    radius, width = 0.1, 0.03
    turns = [2.0 * math.pi * corner / 40 for corner in range(40)]
    rims = [
        [(radius * math.cos(turn), radius * math.sin(turn), z) for turn in turns]
        for z in (-width / 2, width / 2)
    ]
    corners = "".join(f"v {x} {y} {z}\n" for rim in rims for x, y, z in rim)
    lids = [(1, i + 1, i) for i in range(2, 40)] + [(41, i, i + 1) for i in range(42, 80)]
    sides = [(i + 1, (i + 1) % 40 + 1, 41 + i) for i in range(40)]
    sides += [((i + 1) % 40 + 1, 41 + (i + 1) % 40, 41 + i) for i in range(40)]
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in lids + sides)
    (tmp_path / "wheel.obj").write_text(corners + faces, encoding="utf-8")
    text = cart(30.0, radius, 0.5).urdf
    cylinder = f"<cylinder radius='{radius}' length='{0.3 * radius}'/>"
    assert cylinder in text
    robot = parse_urdf(text.replace(cylinder, "<mesh filename='wheel.obj'/>"), tmp_path / "cart.urdf")
    assert missed(check_drive(robot)) == {}


@pytest.mark.parametrize("mass", [1.35, 30.0, 200.0])
def test_four_scrubbing_wheels_turn_as_the_closed_form_says(mass: float) -> None:
    """All wheels stay down: when they hopped, a 30 kg cart turned at half its rate."""
    robot = cart(mass, 0.1, 0.5, (0.2, -0.2), behind=0.0)
    assert robot.drive is not None
    measured = calibrated_track_ratio(convert(robot), timestep=0.002)
    assert measured == pytest.approx(1 + (0.2 / 0.25) ** 2, rel=0.01)
    assert analytic_track_ratio(robot.drive, robot) == pytest.approx(1 + (0.2 / 0.25) ** 2)


def test_loads_that_differ_are_part_of_the_theory() -> None:
    """With more weight behind, the robot turns about its rear axle and slips less."""
    robot = cart(30.0, 0.1, 0.5, (0.2, -0.2))
    assert robot.drive is not None
    theory = analytic_track_ratio(robot.drive, robot)
    assert theory < 1.5 < analytic_track_ratio(robot.drive, robot, equal_loads=True)
    assert calibrated_track_ratio(convert(robot), timestep=0.002) == pytest.approx(theory, rel=0.01)


def test_a_report_tells_both_theories_and_asks_less_of_circles_with_unequal_loads() -> None:
    bars = {}
    for behind in (0.0, 0.05):
        robot = cart(30.0, 0.1, 0.5, (0.2, -0.2), behind=behind)
        report = _check(robot, 0.002, lambda ground, robot: iter(()))
        assert report.equal_load_track_ratio == pytest.approx(1 + (0.2 / 0.25) ** 2)
        assert robot.drive is not None
        assert report.analytic_track_ratio == pytest.approx(analytic_track_ratio(robot.drive, robot))
        bars[behind] = _circle_bar(robot.drive, robot)
    assert bars == {0.0: 0.5, 0.05: 2.5}


def test_a_robot_that_has_turned_does_not_turn_again_and_another_one_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    turns: list[float] = []
    spin = ProvingGround.spin
    monkeypatch.setattr(ProvingGround, "spin", lambda self, angle: turns.append(angle) or spin(self, angle))
    drive_check._CALIBRATED.clear()
    robot = cart(30.0, 0.1, 0.5, (0.2, -0.2))
    first = calibrated_track_ratio(convert(robot), timestep=0.002)
    count = len(turns)
    assert calibrated_track_ratio(convert(robot), timestep=0.002) == first
    assert len(turns) == count
    calibrated_track_ratio(convert(robot), timestep=0.004)
    assert len(turns) > count
    count = len(turns)
    wider = calibrated_track_ratio(convert(cart(30.0, 0.1, 0.6, (0.2, -0.2))), timestep=0.002)
    assert len(turns) > count
    assert wider != first
    heavier = convert(robot)
    heavier.spec.bodies[1].mass *= 3.0
    count = len(turns)
    calibrated_track_ratio(heavier, timestep=0.002)
    assert len(turns) > count


def test_only_skid_steers_are_calibrated() -> None:
    assert calibrated_track_ratio(convert(load("diff_bot")), timestep=0.002) is None
    assert calibrated_track_ratio(convert(load("sp1s"), base="fixed"), timestep=0.002) is None


def test_ideal_kinematics_is_the_closed_form() -> None:
    robot = load("diff_bot")
    assert robot.drive is not None
    ground = ProvingGround(convert(robot), drive_config(robot.drive, robot))
    assert ground.straight(1.0).ideal.distance(Pose2(1.0, 0.0, 0.0)) < 1e-9
    assert ground.spin(-math.pi).ideal_angle == pytest.approx(-math.pi)
    circle = ground.circle(-0.5)
    assert circle.ideal_angle == pytest.approx(-2 * math.pi)
    assert circle.ideal.distance(Pose2(0.0, 0.0, 0.0)) < 0.02, "the ramps of v and w do not match"


def test_the_same_twice() -> None:
    assert check_drive(cart(5.0, 0.05, 0.3)) == check_drive(cart(5.0, 0.05, 0.3))


def test_a_mirrored_wheel_is_told_in_plain_words() -> None:
    words = missed(check_drive(flipped(load("diff_bot"), "wheel_right_joint")))
    assert "of 5 m" in words["straight 5 m"]
    assert words["straight 5 m"].startswith("drives ")
    assert words["spin 360 degrees left"].startswith("turns ")


def test_a_wrong_radius_is_the_error_it_makes() -> None:
    robot = cart(5.0, 0.05, 0.3)
    assert robot.drive is not None
    robot = replace(robot, drive=replace(robot.drive, wheel_radius=0.06))
    assert missed(check_drive(robot))["straight 5 m"] == "drives 4.167 m of 5 m"


@pytest.mark.skipif(not SEED.exists(), reason="the tutorials' models are not here")
def test_the_tutorials_tumbling_wheels() -> None:
    report = check_drive(load(SEED))
    assert report.drive.guessed
    assert (report.drive.left_joints, report.drive.wheel_radius) == (("wheel_left_joint",), 0.05)
    assert {"straight 5 m", "spin 360 degrees left"} <= set(missed(report))


def test_motors_too_weak_for_the_slope_are_no_brake() -> None:
    report = check_drive(cart(30.0, 0.1, 0.5, effort=0.5))
    up = next(item for item in report.manoeuvres if item.name == "stand 5 degrees uphill")
    assert up.bar is None
    assert up.error is not None
    assert up.error > 0.1
    assert "its motors give 0.5 of 1.28 Nm a wheel" in up.words


@pytest.mark.parametrize("limit", ["joint", "command"])
def test_a_robot_is_driven_no_faster_than_its_wheels_may_turn(limit: str) -> None:
    slow = cart(20.0, 0.1, 0.4)
    if limit == "joint":
        joints = {
            name: replace(joint, limit=replace(joint.limit, velocity=2.0))
            for name, joint in slow.joints.items()
        }
        slow = replace(slow, joints=joints)
    else:
        wheels = [*slow.drive.left_joints, *slow.drive.right_joints] if slow.drive else []
        commands = {n: CommandSpec(joint=n, interface="velocity", lower=-2.0, upper=3.0) for n in wheels}
        slow = replace(slow, commands=commands)
    assert slow.drive is not None
    assert drive_config(slow.drive, slow).max_wheel_velocity == 2.0
    ground = ProvingGround(convert(slow), drive_config(slow.drive, slow))
    assert ground.straight(1.0).true.x == pytest.approx(1.0, abs=0.005)
    turn = ground.circle(0.5)
    assert math.degrees(turn.true_angle) == pytest.approx(360.0, abs=1.0)
    crawling = replace(drive_config(slow.drive, slow), max_wheel_velocity=1e-3)
    with pytest.raises(SimulationError, match="too slow: it would take"):
        ProvingGround(convert(slow), crawling).straight(1.0)


def test_a_robot_that_hardly_turns_has_no_radius() -> None:
    heavy = cart(20.0, 0.1, 0.4, effort=1e-3)
    report = check_drive(heavy)
    circles = [item for item in report.manoeuvres if item.name.startswith("circle")]
    assert all(item.error is not None and item.error <= 101.0 for item in circles)
    assert "of 360 degrees" in circles[0].words
    assert "radius" not in circles[0].words


def test_the_hill_is_where_the_heading_says() -> None:
    """A robot without brakes rolls down: backwards if it faces uphill."""
    robot = cart(30.0, 0.1, 0.5, effort=0.5)
    assert robot.drive is not None
    ground = ProvingGround(convert(robot), drive_config(robot.drive, robot), physics=Physics())
    assert ground.hold(math.radians(5.0), math.pi / 2, 1.0) < 1e-4
    assert ground.hold(math.radians(5.0), 0.0, 1.0) > 0.1
    assert ground.hold(0.0, 0.0, 1.0) < 1e-5


def test_the_self_check_of_a_conversion() -> None:
    found = drive_self_check(load("diff_bot"))
    assert found is not None
    assert found["passed"]
    assert found["straight_1_m_error"] < 1e-3
    assert found["spin_360_error"] < 0.3
    broken = drive_self_check(flipped(load("diff_bot"), "wheel_right_joint"))
    assert broken is not None
    assert not broken["passed"]
    assert "of 1 m" in broken["words"][0]
    assert drive_self_check(load("r2d2")) is None


def test_a_robot_that_drives_5_m_true_drives_1_m_true() -> None:
    # A millimetre is lost when a light robot that tips at the start sets out, however far it drives then.
    straight = drive_self_check(cart(1.0, 0.03, 0.2, behind=0.1))
    assert straight is not None
    assert straight["passed"]
