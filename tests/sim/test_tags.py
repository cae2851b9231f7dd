"""Tags are to look at: the world moves as without them."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from twin.errors import ScenarioError
from twin.geometry import Pose3
from twin.sim.scene import Scene, Tag
from twin.sim.world import World


def tag(name: str = "tag", number: int = 3) -> Tag:
    pose = Pose3.from_xyz_rpy((2.0, 0.0, 1.0))
    return Tag(name=name, family="tag36h11", number=number, size=0.16, T_world_tag=pose)


def test_physics_knows_nothing_of_tags() -> None:
    world = World.compose(Scene(name="room", tags=(tag(),)), [])
    assert world.model.ngeom == World.compose(Scene(name="room"), []).model.ngeom


def test_a_tag_is_drawn_with_its_face_where_its_pose_is() -> None:
    model = World.compose(Scene(name="room", tags=(tag(), tag("twice"), tag("other", 4))), []).model_to_see()
    geom, data = model.geom("tag"), mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    half = geom.size
    assert half[:2] == pytest.approx((0.1, 0.1)), "a border of white, a module wide, is around the black one"
    face = data.geom("tag").xpos + data.geom("tag").xmat.reshape(3, 3) @ (0.0, 0.0, half[2])
    assert face == pytest.approx((2.0, 0.0, 1.0))
    assert not geom.contype[0]
    assert not geom.conaffinity[0]
    assert model.ntex == World.compose(Scene(name="room", tags=(tag(), tag("o", 4))), []).model_to_see().ntex


def test_the_world_is_written_with_its_tags(tmp_path: Path) -> None:
    path = World.compose(Scene(name="room", tags=(tag(),)), []).save_model(tmp_path)
    assert mujoco.MjModel.from_xml_path(str(path)).geom("tag").matid[0] >= 0


def test_two_things_of_one_name_are_refused() -> None:
    with pytest.raises(ScenarioError, match="2 things in scene 'room' have the name 'tag'"):
        World.compose(Scene(name="room", tags=(tag(), tag(number=4))), [])
