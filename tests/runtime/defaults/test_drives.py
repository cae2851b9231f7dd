"""Robots whose file has no drive plugin: guessed by their wheels, or refused when they are to move."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from twin.errors import ScenarioError
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

MakeScenario = Callable[[str], Scenario]

SHAPE = "<collision><origin rpy='{} 0 0'/><geometry>{}</geometry></collision>"
MASS = (
    "<inertial><origin xyz='{2} 0 0'/><mass value='{0}'/><inertia ixx='{1}' iyy='{1}' izz='{1}'/></inertial>"
)
WHEEL = MASS.format(0.2, 1e-3, 0) + SHAPE.format(math.pi / 2, "<cylinder radius='0.05' length='0.02'/>")
JOINT = (
    "<joint name='{0}_joint' type='continuous'><origin xyz='0 {1} 0'/><parent link='base'/>"
    "<child link='{0}'/><axis xyz='0 1 0'/><limit effort='2' velocity='20'/></joint>"
)
CASTER = (
    "<link name='caster'>"
    + SHAPE.format(0, "<sphere radius='0.02'/>")
    + "</link><joint name='c' type='fixed'>"
    "<origin xyz='0.1 0 -0.03'/><parent link='base'/><child link='caster'/></joint>"
)
SCENARIO = """
name: moves
duration: 10 s
robots: [{{model: {}, name: cart{}}}]
mission: {}
checks: [{{mission_succeeded: }}]
"""
AHEAD = "{type: behaviors, robot: cart, steps: [{drive_on_heading: {distance: 0.2 m}}]}"
PROFILE = "{type: velocity_profile, robot: cart, steps: [{duration: 1 s, linear: 0.2}]}"
WAIT = "{type: behaviors, robot: cart, steps: [{wait: {duration: 1 s}}]}"
NAVIGATES = ", localisation: {type: odometry}, navigation: {}"


def cart(folder: Path, extra: str = "", wheels: str = WHEEL) -> Path:
    """Write a cart with two wheels and a caster; `extra` is line 2 of its file."""
    text = f"<robot name='cart'><link name='base'>{MASS.format(2, 1e-2, 0.05)}</link>{CASTER}"
    text += "".join(
        f"<link name='{side}'>{wheels}</link>" + JOINT.format(side, y)
        for side, y in (("left", 0.15), ("right", -0.15))
    )
    file = folder / "cart.urdf"
    file.write_text(f"{text}\n{extra}</robot>", encoding="utf-8")
    return file


def test_a_robot_without_a_drive_plugin_is_driven_by_its_wheels_and_that_is_told(
    scenario: MakeScenario, make_run: Callable[..., Run], tmp_path: Path
) -> None:
    said: list[str] = []
    text = SCENARIO.format(cart(tmp_path), "", AHEAD)
    run = make_run(
        scenario(text), taps=[lambda s: said.append(s.message.msg) if s.topic == "/rosout" else None]
    )
    while not run.over:
        run.tick()
    assert run.parts.mission.succeeded, run.parts.mission.reason
    (stack,) = run.parts.stacks.values()
    assert run.world.pose(stack.handle.base).xyz[0] == pytest.approx(0.2, abs=0.05)
    words = "'cart' has no drive plugin; by its wheels it is diff_drive with 'left_joint' left"
    assert any(sentence.startswith(words) for sentence in said)


@pytest.mark.parametrize(
    ("more", "mission", "task"),
    [
        ("", AHEAD, "the mission behaviors"),
        ("", PROFILE, "the mission velocity_profile"),
        (NAVIGATES, "{type: idle}", "its navigation"),
    ],
)
def test_a_robot_that_cannot_drive_is_refused_when_it_is_to_move(
    more: str, mission: str, task: str, scenario: MakeScenario, tmp_path: Path
) -> None:
    file = cart(tmp_path, wheels=MASS.format(0.2, 1e-3, 0))
    text = SCENARIO.format(file, more, mission).replace("mission_succeeded: ", "odometry_drift: {max: 1 m}")
    with pytest.raises(ScenarioError) as caught:
        build(scenario(text))
    why = "the file has no drive plugin, nor wheels that turn freely on both sides"
    assert f"{file}: robot 'cart' has no drive, which {task} needs: {why}; add the plugin" in str(
        caught.value
    )


def test_the_plugin_that_moves_it_otherwise_is_named_with_its_line(
    scenario: MakeScenario, tmp_path: Path
) -> None:
    file = cart(tmp_path, "<gazebo><plugin name='p' filename='libgazebo_ros_planar_move.so'/></gazebo>")
    with pytest.raises(ScenarioError) as caught:
        build(scenario(SCENARIO.format(file, "", PROFILE)))
    assert f"{file}:2: robot 'cart' has no drive" in str(caught.value)
    assert "the plugin 'gazebo_ros_planar_move', which moves it, is not simulated" in str(caught.value)


def test_a_robot_that_only_waits_needs_no_drive(scenario: MakeScenario, tmp_path: Path) -> None:
    file = cart(tmp_path, wheels=MASS.format(0.2, 1e-3, 0))
    parts = build(scenario(SCENARIO.format(file, "", WAIT)))
    parts.bus.close()
