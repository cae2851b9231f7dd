"""The warehouse robot's arm holds its poses and keeps clear of itself; a grasp is as good as its friction."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from twin.geometry import Pose3
from twin.models import link_poses, load
from twin.models.description import RobotDescription, Surface

TOTE = Pose3.from_xyz_rpy((0.80, 0.0, 1.0))


@pytest.mark.parametrize(
    ("lift", "stage", "yaw"),
    [(0.0, 0.0, 0.0), (1.05, 0.32, 0.0), (0.5, 0.16, 1.6), (1.05, 0.32, -1.6), (0.3, 0.32, 0.5)],
)
def test_holds_its_pose(lift: float, stage: float, yaw: float, bare_world: Callable) -> None:
    bot = load("warehouse_bot")
    positions = {
        "lift_joint": lift,
        "arm_stage_1_joint": stage,
        "wrist_yaw_joint": yaw,
        "left_finger_joint": 0.1,
    }
    world = bare_world(bot)
    world.place(positions)
    world.step(1.0)
    assert (
        np.linalg.norm(world.pose("grasp_frame").xyz - link_poses(bot, positions)["grasp_frame"].xyz) < 0.003
    )


def test_touches_nothing_of_itself_where_its_header_allows(bare_world: Callable) -> None:
    world = bare_world(load("warehouse_bot"))
    lifts, stages = np.linspace(0.0, 1.05, 4), np.linspace(0.0, 0.32, 9)
    yaws, grips = np.linspace(-1.6, 1.6, 17), np.linspace(0.0, 0.17, 6)
    for lift, stage, yaw, grip in itertools.product(lifts, stages, yaws, grips):
        if stage < 0.08 and abs(yaw) > 0.3:
            continue
        world.place(
            {
                "lift_joint": lift,
                "arm_stage_1_joint": stage,
                "wrist_yaw_joint": yaw,
                "left_finger_joint": grip,
            }
        )
        assert not world.self_contacts(), (lift, stage, yaw, grip)


def test_a_gripper_turned_into_the_mast_is_noticed(bare_world: Callable) -> None:
    world = bare_world(load("warehouse_bot"))
    world.place({"wrist_yaw_joint": 0.8})
    assert ("r/mast", "r/palm") in world.self_contacts()


def test_lidar_sees_past_its_own_robot(bare_world: Callable) -> None:
    import mujoco

    bot = load("warehouse_bot")
    world = bare_world(bot)
    world.step(0.5)
    groups = np.array([0, 0, 0, 1, 0, 0], dtype=np.uint8)
    for sensor in (bot.sensors[0], bot.sensors[1]):
        body = world.model.body(f"r/{sensor.link}").id
        geom, origin = np.zeros(1, dtype=np.int32), world.data.xpos[body]
        for angle in np.linspace(sensor.angle_min, sensor.angle_max, sensor.samples):
            ray = world.data.xmat[body].reshape(3, 3) @ (np.cos(angle), np.sin(angle), 0.0)
            distance = mujoco.mj_ray(world.model, world.data, origin, ray, groups, 1, body, geom)
            assert distance < 0, (sensor.name, angle, world.model.geom(geom[0]).bodyid)


def take_tote(description: RobotDescription, bare_world: Callable, tote: Pose3 = TOTE) -> tuple:
    """Reach for the tote, close and lift; return the world and how the tote was held before the lift."""
    world = bare_world(description, tote=tote)
    world.move("left_finger_joint", 0.17)
    world.move("lift_joint", 0.58)
    world.move("arm_stage_1_joint", 0.30)
    world.move("left_finger_joint", 0.0)
    held = world.T_grasp_tote()
    world.move("lift_joint", 0.66)
    return world, held


def with_pad_friction(description: RobotDescription, friction: float) -> RobotDescription:
    surface = Surface(friction=friction)
    fingers = {
        name: replace(description.links[name], surface=surface) for name in ("left_finger", "right_finger")
    }
    return replace(description, links={**description.links, **fingers})


def test_a_grasped_tote_stays_through_lifting_carrying_and_shaking(bare_world: Callable) -> None:
    world, held = take_tote(load("warehouse_bot"), bare_world)
    assert world.data.body("tote").xpos[2] == pytest.approx(1.08, abs=0.003)
    world.move("arm_stage_1_joint", 0.0)
    world.move("lift_joint", 0.0)
    touching = {
        world.model.body(world.model.geom_bodyid[geom]).name
        for contact in world.data.contact[: world.data.ncon]
        for geom in contact.geom
        if "tote" in [world.model.body(world.model.geom_bodyid[g]).name for g in contact.geom]
    }
    assert touching == {"tote", "r/left_finger", "r/right_finger"}, "it floats over the deck"
    for _ in range(3):
        world.travel(0.8, v=0.8, ramp=0.4)
        world.travel(0.8, v=-0.8, ramp=0.4)
    assert np.linalg.norm(world.T_grasp_tote().xyz - held.xyz) < 0.001
    # MuJoCo's friction has no term for the turning of its frame: a held body drifts outwards by about
    # 0.6 mm times turn rate [rad/s] times angle [rad] at 2 ms.
    for _ in range(2):
        world.travel(3.2, w=0.5)
        world.travel(3.2, w=-0.5)
    assert np.linalg.norm(world.T_grasp_tote().xyz - held.xyz) < 0.003


def test_a_crooked_tote_is_drawn_to_the_middle_and_held(bare_world: Callable) -> None:
    tote = Pose3.from_xyz_rpy((0.80, 0.02, 1.0), (0.0, 0.0, 0.05))
    world, held = take_tote(load("warehouse_bot"), bare_world, tote)
    assert abs(held.xyz[1]) < 0.001
    assert abs(held.to_pose2().yaw) < 0.02
    assert np.linalg.norm(world.T_grasp_tote().xyz - held.xyz) < 0.001


def test_without_friction_the_tote_stays_behind(bare_world: Callable) -> None:
    world, _ = take_tote(with_pad_friction(load("warehouse_bot"), 0.05), bare_world)
    assert world.data.body("tote").xpos[2] == pytest.approx(1.0, abs=0.002)
