"""Composition, stepping, truth, determinism."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
import pytest

from tests.sim.conftest import box, placed, tote
from twin.errors import ScenarioError, SimulationError
from twin.geometry import Pose2, Pose3
from twin.models.shapes import Box
from twin.sim.physics import Physics
from twin.sim.scene import FreeBody, Scene, Shape, StaticBody
from twin.sim.world import World


def drive(world: World, seconds: float, left: float, right: float, robot: str = "cart") -> None:
    hardware = world.robots[robot].hardware
    for _ in range(round(seconds / 0.02)):
        hardware.command("left_wheel_joint", left)
        hardware.command("right_wheel_joint", right)
        hardware.apply()
        world.step(10)


def test_links_are_named_after_their_robot(room: Scene) -> None:
    world = World.compose(room, [placed(Pose2(1.0, -0.5, math.pi / 2))])
    assert world.body_names == (
        "tote", "cart/base_link", "cart/laser", "cart/imu", "cart/left_wheel", "cart/right_wheel",
        "cart/mast",
    )  # fmt: skip
    laser = world.pose("cart/laser")
    np.testing.assert_allclose(laser.xyz, [1.0, -0.45, 0.18], atol=1e-12)
    xyz, quat = world.body_poses()
    assert xyz.shape == (7, 3)
    assert quat.shape == (7, 4)
    np.testing.assert_array_equal(xyz[2], laser.xyz)


def test_static_poses_and_unknown_bodies(room: Scene) -> None:
    world = World.compose(room, [placed()])
    np.testing.assert_array_equal(world.pose("shelf").xyz, [-2.0, 1.5, 0.385])
    with pytest.raises(ScenarioError, match="no body 'cart/lasr' in the world; did you mean 'cart/laser'"):
        world.pose("cart/lasr")


def test_names_must_differ(room: Scene) -> None:
    with pytest.raises(ScenarioError, match="2 things in scene 'room' have the name 'cart'"):
        World.compose(room, [placed(), placed(Pose2(1.0, 1.0, 0.0))])


def test_a_robot_drives_as_its_wheels_turn(room: Scene) -> None:
    world = World.compose(room, [placed()])
    drive(world, 0.5, 8.0, 8.0)  # the wheels slip while they start
    x0 = world.pose("cart/base_link").xyz[0]
    angle0 = world.data.joint("cart/left_wheel_joint").qpos[0]
    drive(world, 2.5, 8.0, 8.0)
    x, y, yaw = world.pose("cart/base_link").to_pose2()
    turned = world.data.joint("cart/left_wheel_joint").qpos[0] - angle0
    assert x - x0 == pytest.approx(turned * 0.05, rel=0.02)
    assert x - x0 > 0.95
    assert abs(y) < 0.001
    assert abs(yaw) < 0.001
    assert world.time_ns == 3_000_000_000


def test_two_robots_do_not_share_parts(room: Scene) -> None:
    first = placed(Pose2(0.0, 1.0, 0.0))
    second = replace(placed(Pose2(0.0, -1.0, 0.0)), name="other")
    world = World.compose(room, [first, second])
    drive(world, 1.0, 5.0, 5.0, robot="other")
    assert world.pose("cart/base_link").xyz[0] == pytest.approx(0.0, abs=1e-3)
    assert world.pose("other/base_link").xyz[0] > 0.2


def test_fixed_and_kinematic_bases(room: Scene) -> None:
    start = Pose3.from_xyz_rpy((0.5, 0.0, 0.3), (0.0, 0.0, 1.0))
    fixed = World.compose(room, [placed(start, "fixed")])
    fixed.step(200)
    np.testing.assert_allclose(fixed.pose("cart/base_link").xyz, start.xyz)
    with pytest.raises(ValueError, match="no kinematic base"):
        fixed.robots["cart"].set_kinematic_pose(start)

    moved = World.compose(room, [placed(start, "kinematic")])
    moved.robots["cart"].set_kinematic_pose(Pose3.from_xyz_rpy((0.0, 1.0, 0.4)))
    moved.step(10)
    np.testing.assert_allclose(moved.pose("cart/base_link").xyz, [0.0, 1.0, 0.4], atol=1e-12)


def test_a_tote_rests_and_sleeps_where_it_was_put(room: Scene) -> None:
    world = World.compose(room, [placed()])
    start = world.pose("tote")
    for _ in range(50):
        world.step(50)
        assert np.linalg.norm(world.pose("tote").xyz - start.xyz) < 1e-4
    awake = world.data.body_awake
    assert awake[world.model.body("tote").id] == mujoco.mjtSleepState.mjS_ASLEEP
    assert awake[world.model.body("cart/base_link").id] == mujoco.mjtSleepState.mjS_AWAKE


def test_a_tote_wakes_when_pushed(room: Scene) -> None:
    scene = Scene(name="push", goods=(tote("tote", (0.6, 0.0, 0.09)),))
    world = World.compose(scene, [placed()])
    world.step(500)
    drive(world, 2.0, 6.0, 6.0)
    assert world.pose("tote").xyz[0] > 0.62


def test_paint_is_neither_heavy_nor_solid() -> None:
    paint = Shape(geometry=Box(size=(0.5, 0.5, 0.5)), solid=False)
    body = Shape(geometry=Box(size=(0.2, 0.2, 0.2)))
    free = FreeBody(name="box", T_world_body=Pose3.from_xyz_rpy((0, 0, 0.1)), shapes=(body, paint), mass=2.0)
    stage = StaticBody(name="stage", T_world_body=Pose3.from_xyz_rpy(), shapes=(paint,))
    world = World.compose(Scene(name="paint", goods=(free,), statics=(stage,)), [])
    world.step(100)
    assert world.model.body("box").mass[0] == pytest.approx(2.0)
    assert world.pose("box").xyz[2] == pytest.approx(0.1, abs=1e-4)
    side = 2.0 * 0.2**2 / 6.0
    np.testing.assert_allclose(world.model.body("box").inertia, [side] * 3)


def test_contacts_name_what_a_robot_touches(room: Scene) -> None:
    world = World.compose(room, [placed(Pose2(2.6, 0.0, 0.0))])
    assert world.contacts() == []
    drive(world, 2.0, 5.0, 5.0)
    (contact,) = world.contacts()
    assert (contact.body1, contact.body2) == ("cart/base_link", "wall_east")
    assert 1.0 < contact.force_N < 200.0
    assert contact.geoms[0] == ("cart/chassis", "wall_east#0")


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_no_contact_is_missed_while_contacts_come(
    room: Scene, cone: Literal["elliptic", "pyramidal"]
) -> None:
    """Every contact of every tick, found one by one."""
    scene = replace(room, goods=(tote("tote", (2.7, 0.0, 0.09)),))
    world = World.compose(scene, [placed(Pose2(2.2, 0.0, 0.0))], Physics(cone=cone))
    model, data, force = world.model, world.data, np.zeros(6)
    seen = set()
    for _ in range(90):
        drive(world, 0.02, 5.0, 5.0)
        pairs: dict[tuple[str, str], float] = {}
        of_tote = []
        for i, contact in enumerate(data.contact):
            names = [model.body(model.geom_bodyid[geom]).name for geom in contact.geom]
            others = [model.geom(geom).name.partition("#")[0] for geom in contact.geom]
            mine = [name.startswith("cart/") for name in names]
            if contact.efc_address < 0:
                continue
            mujoco.mj_contactForce(model, data, i, force)
            if "tote" in names:
                sign = -1.0 if names[0] == "tote" else 1.0
                push = tuple((sign * force[0] * contact.frame[:3]).tolist())
                named = [names[k] if mine[k] else others[k] for k in range(2)]
                of_tote.append((named[1 - names.index("tote")], push))
            if "floor" not in others and any(mine) and not all(mine):
                key = names[mine.index(True)], others[mine.index(False)]
                pairs[key] = pairs.get(key, 0.0) + float(force[0])
        assert {(c.body1, c.body2): c.force_N for c in world.contacts()} == pairs
        assert world.touches("tote") == of_tote
        seen.add((len(pairs), len(of_tote) > 0))
    assert seen >= {(0, True), (1, True)}


def test_the_same_seed_is_the_same_run_whether_sampled_or_not(room: Scene) -> None:
    digests = []
    for sampled in (False, True):
        world = World.compose(room, [placed()], seed=3)
        for _ in range(50):
            world.robots["cart"].hardware.command("left_wheel_joint", 4.0)
            world.robots["cart"].hardware.apply()
            world.step(10)
            if sampled:
                world.robots["cart"].hardware.read()
                world.contacts()
                for sensor in world.robots["cart"].sensors:
                    sensor.sample(world.time_ns)
        digests.append(world.state_digest())
    assert world.step_count == 500
    assert digests[0] == digests[1]
    world.step(1)
    assert world.state_digest() != digests[1]


def test_divergence_stops_the_run_and_leaves_evidence(room: Scene, tmp_path: Path) -> None:
    world = World.compose(room, [placed()], crash_folder=tmp_path)
    drive(world, 2.0, 1.0, 1.0)
    world.data.qfrc_applied[world.model.joint("cart/mast_joint").dofadr[0]] = 1e12
    with pytest.raises(
        SimulationError,
        match=r"diverged at t = 2\.00\d s: the \w+ of joint 'cart/mast_joint' \(body 'cart/mast'",
    ):
        world.step(10)
    saved = np.load(tmp_path / "diverged.npz")
    assert len(saved["states"]) >= 50
    assert np.isfinite(saved["states"][0]).all()
    assert np.all(np.diff(saved["times"]) > 0)


def test_saved_model_moves_as_the_world_does(room: Scene, tmp_path: Path) -> None:
    world = World.compose(room, [placed()])
    file = world.save_model(tmp_path)
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    data.ctrl[:] = world.data.ctrl[:] = 1.0
    mujoco.mj_step(model, data, 100)
    world.step(100)
    np.testing.assert_allclose(data.qpos, world.data.qpos, atol=1e-6)


def test_shapes_tell_scenery_from_what_moves(room: Scene) -> None:
    world = World.compose(room, [placed()])
    shapes = world.shapes()
    assert {s.body for s in shapes if s.static} == {s.name for s in room.statics}
    moving = {s.body for s in shapes if not s.static}
    assert moving == {"tote", "cart/base_link"}
    assert moving <= set(world.body_names)


def test_physics_options_reach_the_model() -> None:
    world = World.compose(Scene(name="empty"), [], Physics(timestep=0.004, gravity=1.62, cone="pyramidal"))
    assert world.model.opt.timestep == 0.004
    assert world.model.opt.gravity[2] == -1.62
    assert world.model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
    assert world.timestep_ns == 4_000_000
    assert hashlib.sha256().digest_size == len(world.state_digest())


def test_adding_an_obstacle_is_composing_it(room: Scene) -> None:
    blocked = replace(room, statics=(*room.statics, box("crate", (1.0, 0.0, 0.25), (0.4, 0.4, 0.5))))
    world = World.compose(blocked, [placed()])
    drive(world, 4.0, 8.0, 8.0)
    assert world.pose("cart/base_link").xyz[0] < 0.7


def test_visuals_are_for_rendering_and_change_no_motion(room: Scene) -> None:
    bare = World.compose(room, [placed(sensors=())], seed=1)
    seen = World.compose(room, [placed(sensors=())], seed=1, visuals=True)
    assert bare.model.ngeom < seen.model.ngeom
    for world in (bare, seen):
        world.step(500)
    assert bare.state_digest() == seen.state_digest()


def test_what_a_camera_sees_of_light_and_floor(room: Scene) -> None:
    model = World.compose(room, [placed()]).model
    assert model.light("sun").castshadow == 1
    assert model.mat("floor").reflectance == 0.0, "no mirror"
    assert ((model.geom_rgba >= 0.0) & (model.geom_rgba <= 1.0)).all()


def test_floor_and_goods_roll_and_twist_as_mujoco_has_it_by_default(room: Scene) -> None:
    model, default = World.compose(room, [placed()]).model, mujoco.MjSpec().default.geom.friction
    assert model.geom("floor").friction.tolist() == [room.floor_friction, *default[1:]]
    assert model.geom_friction[:, 1:] == pytest.approx(np.tile(default[1:], (model.ngeom, 1)))
