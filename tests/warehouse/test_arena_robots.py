"""The project's own robots in the warehouse."""

from __future__ import annotations

import numpy as np
import pytest

from twin.convert import convert
from twin.geometry import Pose2
from twin.models import load
from twin.sensors.lidar import LidarSpec
from twin.sim.robot import RobotPlacement
from twin.sim.world import World
from twin.warehouse import arena as arenas

TOTES = ("tote_a", "tote_b", "tote_c")


def world_of(robot: str, pose: Pose2) -> World:
    arena = arenas.load("warehouse")
    placement = RobotPlacement(name="bot", conversion=convert(load(robot)), pose=pose)
    return World.compose(arena.scene(TOTES, seed=1), [placement], seed=1)


@pytest.mark.parametrize("robot", ["diff_bot", "warehouse_bot"])
def test_a_robot_stands_still_at_the_start_and_touches_nothing(robot: str) -> None:
    start = arenas.load("warehouse").pose("start")
    world = world_of(robot, start)
    world.step(1000)
    pose = world.pose(world.robots["bot"].base)
    assert start.distance(pose.to_pose2()) < 1e-3
    assert abs(pose.xyz[2]) < 1e-3
    assert world.contacts() == []


@pytest.mark.parametrize("tote", TOTES)
def test_the_lidar_sees_the_rack_in_front(tote: str) -> None:
    arena = arenas.load("warehouse")
    world = world_of("warehouse_bot", arena.tote(tote).approach(1.0))
    world.step(50)
    lidar = next(s for s in world.robots["bot"].sensors if s.spec.name == "lidar")
    spec = lidar.spec
    assert isinstance(spec, LidarSpec)
    ranges = lidar.sample(world.time_ns).ranges
    ahead = ranges[np.abs(np.linspace(spec.angle_min, spec.angle_max, spec.samples)) < 0.02]
    laser = world.pose(f"bot/{spec.link}").to_pose2()
    front = arena.tote(tote).slot.T_map_slot.to_pose2()
    assert np.median(ahead) == pytest.approx(abs(front.inverse().apply([laser[:2]])[0, 0]), abs=0.02)
    # The robot does not see itself.
    assert np.all(ranges > 0.25)
