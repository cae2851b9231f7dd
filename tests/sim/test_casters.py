"""Which links only the floor touches."""

from __future__ import annotations

import mujoco
import pytest

from twin.convert import convert
from twin.geometry import Pose2
from twin.models import load
from twin.sim.casters import casters_under_chassis
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene
from twin.sim.world import World


@pytest.mark.parametrize(
    ("robot", "casters"),
    [
        (
            "warehouse_bot",
            {"caster_front_left", "caster_front_right", "caster_back_left", "caster_back_right"},
        ),
        ("sp1s", set()),
        ("r2d2", set()),
    ],
)
def test_only_frictionless_balls_under_a_fixed_box_count(robot: str, casters: set[str]) -> None:
    assert set(casters_under_chassis(load(robot))) == casters


def test_casters_carry_their_load_and_wheels_still_touch_everything() -> None:
    conversion = convert(load("warehouse_bot"))
    placement = RobotPlacement(name="bot", conversion=conversion, pose=Pose2(0.0, 0.0, 0.0))
    world = World.compose(Scene(name="empty"), [placement])
    world.step(1000)
    assert abs(world.pose("bot/base_footprint").xyz[2]) < 2e-3, "it stands"
    bits = {
        world.model.body(world.model.geom_bodyid[i]).name: int(world.model.geom_contype[i])
        for i in range(world.model.ngeom)
        if world.model.geom_contype[i] and world.model.geom_type[i] != mujoco.mjtGeom.mjGEOM_PLANE
    }
    assert bits["bot/caster_front_left"] == 2
    assert bits["bot/wheel_left"] == 1
    assert bits["bot/base_link"] == 1
