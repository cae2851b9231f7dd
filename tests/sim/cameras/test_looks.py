"""What a world looks like: pictures have it, physics and distances do not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.sim.cameras.conftest import EYE, WALL, Look, built
from twin.geometry import Pose2, Pose3
from twin.models.shapes import Box
from twin.sim.cameras.camera import View
from twin.sim.canvas import Canvas
from twin.sim.looks.dress import dressed
from twin.sim.looks.kept_pictures import kept_picture
from twin.sim.physics import Physics
from twin.sim.scene import Decal, Scene, Shape, StaticBody
from twin.sim.world import World
from twin.warehouse.arena import load

QUARTERS = np.array([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 0)]], np.uint8)
"""Red, green above blue, yellow."""
FACING = Pose3.from_xyz_rpy((EYE[0] + 2.99, 0.0, EYE[2]), (np.pi / 2.0, 0.0, -np.pi / 2.0))
"""On the wall, towards the camera."""


def decal(size: tuple[float, float] = (0.8, 0.8)) -> Decal:
    picture = QUARTERS.repeat(32, 0).repeat(32, 1)
    return Decal(name="quarters", size=size, T_body_decal=FACING, paint=lambda: picture)


def looks_through(scene: Scene) -> View:
    """Return what the camera of a scene sees."""
    plain = built(*scene.statics)
    placements = plain.mount.world._placements
    world = World.compose(scene, placements)
    try:
        return world.robots["mast"].cameras[0].look(0, depth=True)
    finally:
        world.close()


def test_a_decal_is_upright_and_has_no_depth() -> None:
    bare = looks_through(Scene(name="room", statics=(WALL,)))
    seen = looks_through(Scene(name="room", statics=(WALL,), decals=(decal(),)))
    assert seen.colours is not None
    rows, columns = np.array([50, 50, 70, 70]), np.array([70, 90, 70, 90])
    brightest = seen.colours[rows, columns] > 100
    assert brightest.tolist() == (QUARTERS.reshape(4, 3) > 100).tolist()
    np.testing.assert_array_equal(seen.depth, bare.depth)


def test_paint_has_no_depth(camera_at: Look) -> None:
    """As rays go through it."""
    paint = StaticBody(
        name="paint",
        T_world_body=Pose3.from_xyz_rpy((EYE[0] + 2.0, 0.0, EYE[2])),
        shapes=(Shape(geometry=Box(size=(0.1, 0.5, 0.5)), solid=False, rgba=(1.0, 0.0, 0.0, 1.0)),),
    )
    seen = camera_at(WALL, paint).look(0, depth=True)
    assert seen.depth is not None
    assert seen.colours is not None
    assert seen.depth[60, 80] == pytest.approx(3.0, abs=1e-5)
    red, green, _ = seen.colours[60, 80].astype(int)
    assert red > green + 80


def test_shadows_darken_what_is_behind_a_box() -> None:
    """The light comes from above, from behind the camera and from its right."""
    box = StaticBody(
        name="box",
        T_world_body=Pose3.from_xyz_rpy((2.5, 0.0, 1.0)),
        shapes=(Shape(geometry=Box(size=(0.6, 0.6, 0.2))),),
    )
    scene = Scene(name="room", statics=(box,))
    plain, shaded = looks_through(scene).colours, looks_through(replace(scene, shadows=True)).colours
    assert plain is not None
    assert shaded is not None
    darker = plain.astype(int).sum(axis=2) - shaded.astype(int).sum(axis=2) > 60
    assert 30 < darker.sum() < 0.2 * darker.size
    assert darker[76:84].sum() > 0.9 * darker[45:].sum()  # on the floor, and nowhere else on it
    assert not darker[:26].any()  # the sky


def test_looks_leave_physics_alone() -> None:
    """The model that moves has no decals, textures and meshes of theirs."""
    scene = load("warehouse").scene(["tote_a"])
    bare = replace(scene, decals=())
    with_looks, without = World.compose(scene, []).model, World.compose(bare, []).model
    for part in ("nbody", "ngeom", "nmesh", "ntex", "nq", "nv"):
        assert getattr(with_looks, part) == getattr(without, part)
    assert with_looks.nmesh == 0
    seen = dressed(scene, [], Physics()).compile()
    assert (seen.nq, seen.nmocap) == (with_looks.nq, with_looks.nmocap)
    assert seen.ngeom < with_looks.ngeom / 3
    assert seen.ntex > with_looks.ntex + len(scene.decals)


@pytest.fixture(scope="module")
def floor() -> NDArray[np.uint8]:
    """Return the warehouse from 30 m above, 20 m wide, with north up: 24 pixels for each metre."""
    spec = dressed(load("warehouse").scene(), [], Physics())
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 480, 336
    spec.visual.quality.offsamples = 0
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    view = mujoco.MjvCamera()
    view.azimuth, view.elevation, view.distance = 90.0, -90.0, 30.0
    model.vis.global_.orthographic, model.vis.global_.fovy = 1, 14.0
    scene = mujoco.MjvScene(model, model.ngeom + 100)
    scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, view, mujoco.mjtCatBit.mjCAT_ALL, scene)
    canvas = Canvas(model, 480, 336)
    try:
        return canvas.draw(scene)
    finally:
        canvas.close()


def test_zones_are_painted_where_the_arena_has_them(floor: NDArray[np.uint8]) -> None:
    yellow = (floor[..., 0].astype(int) - floor[..., 2] > 70) & (floor[..., 1] > 100)
    x, y = np.meshgrid(np.arange(480) / 24.0 - 10.0, 7.0 - np.arange(336) / 24.0)
    zone = load("warehouse").zone("unloading").area
    near = zone.centre.inverse().apply(np.stack((x[yellow], y[yellow]), axis=1))
    inside = (np.abs(near) < (zone.size_x / 2.0 + 0.1, zone.size_y / 2.0 + 0.1)).all(axis=1)
    border = inside & (np.abs(near[:, 1]) > zone.size_y / 2.0 - 0.3)
    assert border.sum() > 400  # hatched: half of two strips of 3.9 m x 0.3 m has 670
    rack = Pose2(-1.5, 3.9, 0.0)
    lane = yellow & (np.abs(y - rack.y + 0.56) < 0.06) & (np.abs(x - rack.x) < 3.0)
    assert lane.sum() > 80
    assert not yellow[(np.abs(x) < 4.0) & (np.abs(y - 2.1) < 0.6)].any()  # an aisle is free of paint


def test_a_picture_is_painted_once_until_what_was_kept_of_it_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TWIN_CACHE", str(tmp_path))
    painted: list[int] = []

    def paint() -> NDArray[np.uint8]:
        painted.append(1)
        return QUARTERS

    for _ in range(2):
        assert (kept_picture("quarters", paint) == QUARTERS).all()
    assert len(painted) == 1
    (file,) = (tmp_path / "pictures").iterdir()
    for broken in ("", "[]", '{"shape": [9, 9, 3], "zlib": "eJwDAAAAAAE="}', '{"shape": [2], "zlib": "abc"}'):
        file.write_text(broken)
        assert (kept_picture("quarters", paint) == QUARTERS).all(), broken
    assert len(painted) == 5


def test_scenery_that_is_drawn_has_no_part_in_physics() -> None:
    """Mass, shapes and pairs that may touch are those of a world without pictures and tags."""
    scene = load("warehouse").scene(set(), seed=1)
    plain = World.compose(replace(scene, decals=()), ())
    seen = World.compose(replace(scene, decals=(*scene.decals, decal())), ())
    assert plain.model.body_mass.sum() == seen.model.body_mass.sum()
    assert mujoco.mj_sizeModel(plain.model) == mujoco.mj_sizeModel(seen.model)
