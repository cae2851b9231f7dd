"""What is culled before rays are cast must be nothing that a single ray, which is not culled, hits."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tests.sim.conftest import LIDAR, box, placed
from twin.geometry import Array, Pose3
from twin.models.shapes import Box
from twin.sim.compose import GROUP_COLLISION, GROUP_SOLID
from twin.sim.scene import FreeBody, Scene, Shape, StaticBody
from twin.sim.sensors.rays import RayCaster
from twin.sim.world import World


def _slab(name: str, xyz: tuple[float, float, float], rpy: tuple[float, float, float]) -> StaticBody:
    return StaticBody(
        name=name,
        T_world_body=Pose3.from_xyz_rpy(xyz, rpy),
        shapes=(Shape(geometry=Box(size=(2.0, 0.1, 0.3))),),
    )


def _yard(cranes: int = 6) -> Scene:
    """Slabs at all heights and attitudes, and unbalanced bodies."""
    rng = np.random.default_rng(3)
    slabs = [
        _slab(
            f"slab{i}", (*rng.uniform(-4.0, 4.0, 2), rng.uniform(0.0, 1.0)), tuple(rng.uniform(-3.0, 3.0, 3))
        )
        for i in range(40)
    ]
    arms = (
        Shape(geometry=Box(size=(0.4, 0.4, 0.4)), T_body_geometry=Pose3.from_xyz_rpy((-0.6, 0.0, 0.0))),
        Shape(geometry=Box(size=(0.9, 0.05, 0.05)), T_body_geometry=Pose3.from_xyz_rpy((0.3, 0.0, 0.1))),
    )
    unbalanced = [
        FreeBody(
            name=f"crane{i}",
            T_world_body=Pose3.from_xyz_rpy(
                (*rng.uniform(-4.0, 4.0, 2), 0.2), (0.0, 0.0, rng.uniform(-3.0, 3.0))
            ),
            mass=5.0,
            friction=0.5,
            shapes=arms,
        )
        for i in range(cranes)
    ]
    return Scene(
        name="yard", statics=(*slabs, box("wall", (5.0, 0.0, 0.5), (0.2, 9.0, 1.0))), goods=tuple(unbalanced)
    )


def _one_by_one(world: World, link: str, spec_angles: Array) -> Array:
    flat = np.column_stack((np.cos(spec_angles), np.sin(spec_angles), np.zeros(len(spec_angles))))
    return _ray_by_ray(world, link, flat)


def _ray_by_ray(world: World, link: str, directions: Array) -> Array:
    body = world.model.body(link).id
    groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
    groups[[GROUP_SOLID, GROUP_COLLISION]] = 1
    turn, hit = world.data.xmat[body].reshape(3, 3), np.zeros(1, dtype=np.int32)
    result = []
    for direction in directions:
        distance = mujoco.mj_ray(
            world.model, world.data, world.data.xpos[body], turn @ direction, groups, 1, body, hit, None
        )
        result.append(np.inf if distance < 0.0 or distance > LIDAR.range_max else distance)
    return np.array(result)


@pytest.mark.parametrize("tilt", [0.0, 0.01, 0.3])
def test_many_rays_hit_what_single_rays_hit(tilt: float) -> None:
    spec = replace(LIDAR, samples=361, range_min=0.0)
    for yaw in (0.0, 2.0):
        pose = Pose3.from_xyz_rpy((0.0, 0.0, 0.15), (tilt, -tilt, yaw))
        world = World.compose(_yard(), [placed(pose, "kinematic", sensors=(spec,))])
        groups, volumes = world.model.geom_group.copy(), world.model.bvh_aabb.copy()
        ranges = world.robots["cart"].sensors[0].sample(0).ranges
        truth = _one_by_one(world, "cart/laser", np.linspace(spec.angle_min, spec.angle_max, spec.samples))
        np.testing.assert_allclose(ranges, truth, atol=1e-9)
        assert np.isfinite(truth).mean() > 0.5
        np.testing.assert_array_equal(world.model.geom_group, groups)
        np.testing.assert_array_equal(world.model.bvh_aabb, volumes)


def test_a_robot_that_drives_over_bumps_sees_what_single_rays_hit() -> None:
    """What its lidar's plane misses is found anew when the plane has moved, however slowly."""
    spec, rng = replace(LIDAR, samples=61, range_min=0.0), np.random.default_rng(4)
    world = World.compose(_yard(), [placed(Pose3.from_xyz_rpy(), "kinematic", sensors=(spec,))])
    cart, place, turn = world.robots["cart"], np.array([0.0, 0.0, 0.05]), np.zeros(3)
    for _ in range(150):
        place += rng.normal(scale=0.002, size=3)
        turn += rng.normal(scale=0.0005, size=3)
        cart.set_kinematic_pose(Pose3.from_xyz_rpy(place, turn))
        world.step()
        truth = _one_by_one(world, "cart/laser", np.linspace(spec.angle_min, spec.angle_max, spec.samples))
        np.testing.assert_allclose(cart.sensors[0].sample(world.time_ns).ranges, truth, atol=1e-9)


@pytest.mark.parametrize("cranes", [6, 30])
def test_bundles_of_a_lidar_that_is_moved_about_meet_what_single_rays_hit(cranes: int) -> None:
    """Bundles are looked beside together, and anew when the link has moved, however slowly."""
    spec, rng = replace(LIDAR, samples=2), np.random.default_rng(5)
    world = World.compose(_yard(cranes), [placed(Pose3.from_xyz_rpy(), "kinematic", sensors=(spec,))])
    cart, place, turn = world.robots["cart"], np.array([0.0, 0.0, 0.05]), np.zeros(3)
    azimuth, elevation = np.meshgrid(np.linspace(-3.0, 3.0, 50), np.linspace(-0.3, 0.4, 4), indexing="ij")
    level = np.cos(elevation)
    rays = np.stack((np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation)), axis=-1)
    parts = [part.reshape(-1, 3) for part in np.array_split(rays, 10)]
    casters = RayCaster.of_turn(cart.sensors[0].mount, parts, cutoff=LIDAR.range_max)
    groups, counts = world.model.geom_group.copy(), world.model.body_geomnum.copy()
    for step in range(60):
        place += rng.normal((0.01, 0.0, 0.0), 0.005)
        turn += rng.normal((0.0, 0.0, 0.01), 0.002)
        cart.set_kinematic_pose(Pose3.from_xyz_rpy(place, turn))
        world.step()
        number = step % len(parts)
        found = casters[number].cast()
        truth = _ray_by_ray(world, "cart/laser", parts[number])
        np.testing.assert_allclose(np.where(found > LIDAR.range_max, np.inf, found), truth, atol=1e-9)
        assert np.isfinite(truth).any()
    np.testing.assert_array_equal(world.model.geom_group, groups)
    np.testing.assert_array_equal(world.model.body_geomnum, counts)
