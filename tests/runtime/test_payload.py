"""Goods in a gripper or on a deck are part of the robot when it comes to collisions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import pytest

from tests.savings import OFF
from tests.sim.conftest import box, tote
from twin.convert.conversion import Conversion
from twin.geometry import Pose3
from twin.models.description import Joint, Link, RobotDescription
from twin.models.shapes import Box
from twin.runtime.observe import Observer
from twin.savings import ALL, Savings
from twin.scenario.checks import CheckEntry, CheckResult
from twin.scenario.observation import CheckContext
from twin.sim.robot import RobotPlacement
from twin.sim.scene import FreeBody, Scene, Shape, StaticBody
from twin.sim.world import World

JOINTS = {"x": "cart", "z": "lift", "left": "left_finger", "right": "right_finger"}
CRANE = """
<mujoco>
  <worldbody>
    <body name="base">
      <body name="cart">
        <joint name="x" type="slide" axis="1 0 0"/>
        <geom name="cart" type="box" size=".05 .05 .05" pos="0 0 1.5" mass="20" contype="0" conaffinity="0"/>
        <body name="lift" pos="0 0 .5">
          <joint name="z" type="slide" axis="0 0 1"/>
          <geom name="lift" type="box" size=".05 .05 .05" pos="0 0 .5" mass="2" contype="0" conaffinity="0"/>
          <geom name="deck" type="box" size=".2 .2 .01" pos="0 1 0" mass="1"/>
          <body name="left_finger" pos="0 .2 0">
            <joint name="left" type="slide" axis="0 -1 0"/>
            <geom type="box" size=".04 .01 .04" mass=".2" friction="1.6 .005 .0001" solref=".004 1"/>
          </body>
          <body name="right_finger" pos="0 -.2 0">
            <joint name="right" type="slide" axis="0 1 0"/>
            <geom type="box" size=".04 .01 .04" mass=".2" friction="1.6 .005 .0001" solref=".004 1"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="x" joint="x" kp="20000" kv="1500"/>
    <position name="z" joint="z" kp="40000" kv="1500"/>
    <motor name="left" joint="left"/>
    <motor name="right" joint="right"/>
  </actuator>
</mujoco>
"""
GRIP = 80.0
"""Of each finger [N]."""


def goods(
    name: str, xyz: tuple[float, float, float], size: tuple[float, float, float], mass: float
) -> FreeBody:
    shapes = (Shape(geometry=Box(size=size)),)
    return FreeBody(name=name, T_world_body=Pose3.from_xyz_rpy(xyz), shapes=shapes, mass=mass)


def crane() -> RobotPlacement:
    still = Pose3.from_xyz_rpy()
    description = RobotDescription(
        name="crane", source=Path("crane.urdf"), urdf="<robot/>", root="base",
        links={name: Link(name=name) for name in ("base", *JOINTS.values())},
        joints={
            name: Joint(name=name, type="prismatic", parent="base", child=child, T_parent_joint=still)
            for name, child in JOINTS.items()
        },
    )  # fmt: skip
    conversion = Conversion(
        description=description, spec=mujoco.MjSpec.from_string(CRANE), spawn_height=0.0, guesses=(),
        root_joint=None,
    )  # fmt: skip
    return RobotPlacement(name="crane", conversion=conversion, pose=still)


class Handling:
    """A tote of 2.5 kg on a table, a machine 20 cm before it, and a gripper about it."""

    def __init__(
        self,
        *more: FreeBody | StaticBody,
        allowed: Sequence[dict[str, str]] = (),
        savings: Savings = ALL,
    ) -> None:
        scene = Scene(
            name="handling",
            statics=(
                box("table", (0.0, 0.0, 0.2), (1.0, 1.0, 0.4)),
                box("machine", (0.45, 0.0, 0.6), (0.2, 0.4, 0.4)),
                *(part for part in more if isinstance(part, StaticBody)),
            ),
            goods=(
                replace(tote("tote", (0.0, 0.0, 0.49)), friction=1.6),  # as rough as the fingers
                *(part for part in more if isinstance(part, FreeBody)),
            ),
        )
        self.world = World.compose(scene, [crane()], savings=savings)
        mission: Any = SimpleNamespace(state="", done=False, succeeded=None, reason="")
        self.observer = Observer(self.world, (), mission, [good.name for good in scene.goods])
        rules = [{"other": "tote", "body": "*finger"}, *allowed]
        entry = CheckEntry.model_validate({"no_collision": {"allowed": rules}})
        self.check = entry.build(CheckContext(robots=("crane",)))
        self.commands = {"x": 0.0, "z": 0.0, "left": 0.0, "right": 0.0}

    def go(self, seconds: float, **targets: float) -> None:
        """Move joints evenly to positions [m]; fingers take forces [N] at once."""
        ticks, rest = round(seconds / 0.02), 10
        start = dict(self.commands)
        hardware = self.world.robots["crane"].hardware
        for i in range(1, ticks + rest + 1):
            for joint, target in targets.items():
                share = 1.0 if joint in ("left", "right") else min(i / ticks, 1.0)
                self.commands[joint] = start[joint] + share * (target - start[joint])
                hardware.command(joint, self.commands[joint])
            hardware.apply()
            self.world.step(10)
            self.observer.gather()

    def grasp(self) -> None:
        self.go(0.3)
        self.go(0.4, left=GRIP, right=GRIP)

    def release(self) -> None:
        self.go(0.4, left=-5.0, right=-5.0)

    def result(self) -> CheckResult:
        self.check.observe(self.observer.observe())
        return self.check.result()


def test_a_robot_that_stands_among_things_that_stand_is_nothing_to_look_at() -> None:
    handling = Handling()
    handling.go(0.5)
    assert handling.result().reason == "nothing to look at: nothing moved"
    handling.go(0.3, right=5.0)
    assert handling.observer.observe().moved == {"crane"}, "a joint of it did"
    assert handling.result().passed


def test_taking_a_tote_up_and_setting_it_down_is_no_collision() -> None:
    handling = Handling()
    handling.grasp()
    handling.go(0.5, z=0.1)
    assert handling.world.pose("tote").xyz[2] > 0.57, "it was lifted"
    handling.go(0.5, x=-0.1)
    handling.go(0.5, z=0.0)
    handling.release()
    assert handling.result().passed, handling.result().reason
    assert handling.world.pose("tote").xyz[0] == pytest.approx(-0.1, abs=0.01)


AGAINST_THE_MACHINE = 0.206
"""Where the tote would be 6 mm inside of it [m]."""


def test_a_carried_tote_that_is_pressed_against_a_machine_is_a_collision() -> None:
    handling = Handling()
    handling.grasp()
    handling.go(0.5, z=0.1)
    assert handling.result().passed
    handling.go(1.0, x=AGAINST_THE_MACHINE)
    result = handling.result()
    assert not result.passed
    assert 60.0 < result.value < 300.0  # type: ignore[operator]
    assert result.reason.startswith("tote, carried by crane, hit machine with ")


def test_where_nothing_is_new_nothing_is_missed() -> None:
    observations = []
    for savings in (ALL, OFF):
        handling = Handling(goods("box", (-0.3, 0.0, 0.48), (0.1, 0.1, 0.16), mass=1.0), savings=savings)
        for targets in (
            {"left": GRIP, "right": GRIP}, {"z": 0.1}, {"x": AGAINST_THE_MACHINE}, {"x": 0.0}, {"z": 0.03},
            {"x": -0.12}, {"z": 0.0}, {"left": -5.0, "right": -5.0},
        ):  # fmt: skip
            handling.go(0.3, **targets)
            seen = handling.observer.observe()
            observations.append((savings, seen.contacts, seen.moved))
    half = len(observations) // 2
    saved, oracle = ([seen[1:] for seen in each] for each in (observations[:half], observations[half:]))
    assert saved == oracle
    hit = {contact.other for contacts, _ in saved for contact in contacts if contact.carried}
    assert hit >= {"machine", "box"}
    assert saved[-1][1] == {"crane", "tote", "box"}


def test_what_carried_goods_may_touch_can_be_allowed() -> None:
    handling = Handling(allowed=[{"other": "mach*", "body": "tote"}])
    handling.grasp()
    handling.go(0.5, z=0.1)
    handling.go(1.0, x=AGAINST_THE_MACHINE)
    assert handling.result().passed, handling.result().reason


def test_carried_goods_hit_other_goods_too() -> None:
    handling = Handling(goods("box", (-0.3, 0.0, 0.48), (0.1, 0.1, 0.16), mass=1.0))
    handling.grasp()
    handling.go(0.3, z=0.03)
    handling.go(0.5, x=-0.12)
    assert "tote, carried by crane, hit box with" in handling.result().reason


def test_pressing_it_onto_the_table_harder_than_it_is_squeezed_is_a_collision() -> None:
    handling = Handling()
    handling.grasp()
    handling.go(0.5, z=-0.003)
    assert handling.result().passed, handling.result().reason
    handling.go(0.5, z=-0.006)
    result = handling.result()
    assert not result.passed
    assert result.value > 2.0 * GRIP  # type: ignore[operator]
    assert "tote, carried by crane, hit table" in result.reason


def test_dragging_it_along_the_table_is_a_collision() -> None:
    handling = Handling()
    handling.grasp()
    handling.go(0.5, x=-0.005)
    assert handling.result().value == 0.0
    handling.go(1.0, x=-0.05)
    assert "tote, carried by crane, hit table" in handling.result().reason


def test_what_stands_on_a_robots_deck_is_carried() -> None:
    load = goods("box", (0.0, 1.0, 0.56), (0.2, 0.2, 0.1), mass=1.0)
    fence = box("fence", (0.23, 1.0, 0.6), (0.2, 0.2, 0.1))
    handling = Handling(load, fence, allowed=[{"other": "box", "body": "lift"}])
    handling.go(0.5, x=0.01)
    assert handling.result().value == 0.0
    handling.go(0.5, x=0.05)
    assert "box, carried by crane, hit fence with" in handling.result().reason


@pytest.mark.parametrize("x", [0.13, 0.3])
def test_what_stands_on_carried_goods_is_carried_with_them(x: float) -> None:
    pile = [goods(f"box_{i}", (0.0, 1.0, 0.56 + 0.1 * i), (0.2, 0.2, 0.1), mass=1.0) for i in range(3)]
    fence = box("fence", (x + 0.1, 1.0, 0.76), (0.2, 0.2, 0.1))
    handling = Handling(*pile, fence, allowed=[{"other": "box_0", "body": "lift"}])
    handling.go(0.5, x=0.05)
    result = handling.result()
    assert result.passed == (x > 0.15), result.reason
    assert result.passed or "box_2, carried by crane, hit fence with" in result.reason


def test_what_a_robot_only_pushes_is_not_carried() -> None:
    load = goods("box", (0.25, 1.0, 0.5), (0.09, 0.2, 0.1), mass=1.0)
    shelf = box("shelf", (0.4, 1.0, 0.4), (0.5, 0.4, 0.1))
    handling = Handling(load, shelf, allowed=[{"other": "box", "body": "lift"}])
    handling.go(0.5, x=0.05)
    assert handling.world.pose("box").xyz[0] > 0.28, "it was pushed"
    assert handling.result().passed, handling.result().reason
