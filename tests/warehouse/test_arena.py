"""Arenas: the default warehouse keeps its promises, and a bad file is explained in one go."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.errors import ScenarioError
from twin.geometry import Pose2
from twin.models.shapes import Box
from twin.sim.scene import Shape, StaticBody
from twin.sim.world import World
from twin.warehouse import arena as arenas
from twin.warehouse.arena import Arena
from twin.warehouse.arena_file import covered
from twin.warehouse.arena_scene import goods
from twin.warehouse.catalogue import catalogue
from twin.warehouse.footprint import Rectangle, overlap

NAMED = ("tote_a", "tote_b", "tote_c")


@pytest.fixture(scope="module")
def warehouse() -> Arena:
    return arenas.load("warehouse")


def test_runs_share_an_arena_as_long_as_its_file_is_the_same(tmp_path: Path) -> None:
    file = tmp_path / "hall.yaml"
    text = catalogue()["warehouse"].read_text(encoding="utf-8")
    file.write_text(text, encoding="utf-8")
    first, named = arenas.shared(file), "name: warehouse"
    assert arenas.shared(file) is first
    assert arenas.load(file) is not first, "a user's own may be changed"
    assert named in text
    file.write_text(text.replace(named, "name: other"), encoding="utf-8")
    assert (first.name, arenas.shared(file).name) == ("warehouse", "other")


def test_stock_that_runs_share_is_what_it_would_be_anew_and_cannot_be_changed(warehouse: Arena) -> None:
    asked = (warehouse, frozenset(NAMED), 3, (0.01, 0.02))
    shared = goods(*asked)
    assert goods(*asked) is shared
    assert repr(shared) == repr(goods.__wrapped__(*asked))
    for body in (*shared[0], *shared[1]):
        for pose in (body.T_world_body, *(shape.T_body_geometry for shape in body.shapes)):
            assert not pose.xyz.flags.writeable
            assert not pose.quat_wxyz.flags.writeable


def test_it_has_three_racks_of_three_levels(warehouse: Arena) -> None:
    assert list(warehouse.racks) == ["rack_a", "rack_b", "rack_c"]
    for rack in warehouse.racks.values():
        assert (rack.length, rack.depth, rack.levels) == (6.0, 0.6, (0.40, 0.80, 1.20))
        assert len(rack.slots()) == 30


def test_aisles_are_wide_enough_to_turn(warehouse: Arena) -> None:
    """Nothing stands in the 2.2 m before any rack's front."""
    for rack in warehouse.racks.values():
        front = rack.pose @ Pose2(rack.depth / 2.0 + 1.1 + 1e-6, 0.0, 0.0)
        aisle = Rectangle(front, 2.2, rack.length)
        assert warehouse.hall.contains(aisle.corners)
        others = [other.footprint for other in warehouse.racks.values() if other is not rack]
        others += [covered(pillar) for pillar in warehouse.file.pillars.values()]
        others += [covered(pallet) for pallet in warehouse.file.pallets.values()]
        assert not any(overlap(aisle, other) for other in others)


@pytest.mark.parametrize(("name", "height"), [("tote_a", 0.80), ("tote_b", 1.20), ("tote_c", 0.40)])
def test_a_tote_stands_in_its_slot(warehouse: Arena, name: str, height: float) -> None:
    tote = warehouse.tote(name)
    rack = warehouse.racks[tote.slot.shelf]
    assert tote.slot.height == height
    assert tote.T_map_tote.xyz[2] == pytest.approx(height + 0.09)
    local = rack.pose.inverse() @ tote.T_map_tote.to_pose2()
    # The front face is 5 cm behind the rack's edge, the tote's x axis points out of the rack.
    assert local.x + 0.15 == pytest.approx(rack.depth / 2.0 - 0.05)
    assert local.yaw == pytest.approx(0.0)


@pytest.mark.parametrize("name", NAMED)
def test_the_approach_pose_faces_the_tote_from_the_aisle(warehouse: Arena, name: str) -> None:
    tote = warehouse.tote(name)
    approach = tote.approach(0.8)
    ahead = approach @ Pose2(0.8 + 0.05 + 0.15, 0.0, 0.0)
    np.testing.assert_allclose(ahead[:2], tote.T_map_tote.xyz[:2], atol=1e-9)
    assert not warehouse.racks[tote.slot.shelf].footprint.contains([approach[:2]])


@pytest.mark.parametrize("seed", range(5))
def test_a_gripper_has_room_on_both_sides_of_every_named_tote(warehouse: Arena, seed: int) -> None:
    scene = warehouse.scene(NAMED, seed=seed)
    checked = 0
    for tote in warehouse.totes.values():
        real = next(goods.T_world_body for goods in scene.goods if goods.name == tote.name)
        beside = ("stock/" + tote.slot.shelf, tote.slot.shelf)
        for static in scene.statics:
            for shape in static.shapes if static.name.startswith(beside) else ():
                if not shape.solid or not isinstance(shape.geometry, Box):
                    continue
                T = real.inverse() @ static.T_world_body @ shape.T_body_geometry
                x, y, z = np.array(shape.geometry.size) / 2.0
                deep, high = abs(T.xyz[0]) < x + 0.15, abs(T.xyz[2]) < z + 0.08
                if deep and high and abs(T.xyz[1]) < 1.0:
                    # 0.12 m is half the tote; turns of at most 0.06 rad move a corner by another centimetre.
                    assert abs(T.xyz[1]) - y >= 0.12 + 0.12
                    checked += 1
    assert checked >= 3


def test_the_drive_to_each_shelf_is_long(warehouse: Arena) -> None:
    start = warehouse.pose("start")
    assert all(warehouse.tote(name).approach(0.8).distance(start) > 9.5 for name in NAMED)
    assert warehouse.zone("start").contains(start.x, start.y)


def test_the_unloading_zone_has_a_table_with_places(warehouse: Arena) -> None:
    zone = warehouse.zone("unloading")
    assert [slot.name for slot in zone.slots] == ["unloading/0/0", "unloading/0/1", "unloading/0/2"]
    assert warehouse.slot("unloading/0/1").height == 0.40
    stand = zone.slots[1].approach(0.8)
    assert zone.contains(stand.x, stand.y)
    assert stand.yaw == pytest.approx(0.0)


def test_totes_are_not_quite_where_the_plan_says(warehouse: Arena) -> None:
    def placed(seed: int, free: tuple[str, ...]) -> Pose2:
        scene = warehouse.scene(free, seed=seed)
        bodies = {body.name: body for body in (*scene.statics, *scene.goods)}
        return bodies["tote_a"].T_world_body.to_pose2()

    nominal = warehouse.tote("tote_a").T_map_tote.to_pose2()
    errors = [nominal.inverse() @ placed(seed, NAMED) for seed in range(30)]
    assert all(max(abs(e.x), abs(e.y)) <= 0.015 and abs(e.yaw) <= 0.03 for e in errors)
    assert len({round(e.x, 6) for e in errors}) == 30
    assert max(abs(e.y) for e in errors) > 0.01
    # Its error does not depend on which totes are free.
    assert placed(4, NAMED) == placed(4, ()) == placed(4, ("tote_b",))


def test_totes_that_are_not_free_are_scenery(warehouse: Arena) -> None:
    scene = warehouse.scene(["tote_b"], seed=1)
    assert [goods.name for goods in scene.goods] == ["tote_b"]
    assert scene.goods[0].mass == 2.5
    assert scene.goods[0].friction == 0.6
    statics = [static.name for static in scene.statics]
    assert "tote_a" in statics
    stock = [name for name in statics if name.startswith("stock/")]
    assert 60 < len(stock) < 87
    assert not {tote.slot.name for tote in warehouse.totes.values()} & {
        s.removeprefix("stock/") for s in stock
    }


def test_obstacles_are_added(warehouse: Arena) -> None:
    crate = StaticBody(
        name="crate",
        T_world_body=warehouse.tote("tote_a").T_map_tote,
        shapes=(Shape(geometry=Box(size=(1, 1, 1))),),
    )
    assert warehouse.scene(obstacles=[crate]).statics[-1] is crate


def test_every_tote_stays_where_it_stands_for_five_seconds(warehouse: Arena) -> None:
    world = World.compose(warehouse.scene(NAMED, seed=2), [])
    before = {name: world.pose(name) for name in NAMED}
    world.step(2500)
    for name, pose in before.items():
        assert np.linalg.norm(world.pose(name).xyz - pose.xyz) < 1e-4


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda a: a.tote("tote_d"), "arena 'warehouse' has no tote 'tote_d'; did you mean 'tote_"),
        (lambda a: a.zone("unload"), "has no zone 'unload'; did you mean 'unloading'"),
        (lambda a: a.slot("rack_a/3/0"), "has no slot 'rack_a/3/0'"),
        (lambda a: a.pose("stat"), "has no pose 'stat'; did you mean 'start'"),
        (lambda a: a.scene(["tot_a"]), "has no tote 'tot_a'"),
        (
            lambda _: arenas.load("warehose"),
            "no arena 'warehose': neither a file nor known; did you mean 'warehouse'",
        ),
    ],
)
def test_unknown_names_are_answered_with_the_nearest(warehouse: Arena, ask, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        ask(warehouse)


FAULTY = """\
name: faulty
hall: {x: [-5, 5], y: [-5, 5]}
racks:
  first: {pose: [0, 0, 0], length: 4, depth: 0.6, levels: [0.4, 0.8]}
  second:
    pose: [0.4, 1, 0]
    length: 4
    depth: 0.6
    levels: [0.4, 0.5]
    slot_spacing: 20 cm
  outside: {pose: [4.9, 0, 0], length: 1, depth: 0.6, levels: [0.4]}
totes:
  one: {rack: frist, level: 0, slot: 0}
  two:
    rack: first
    level: 2
    slot: 6
  three: {rack: first, level: 0, slot: 1}
  four: {rack: first, level: 0, slot: 1}
  first: {rack: first, level: 0, slot: 2}
zones:
  start: {pose: [0, 0, 90 deg], size: [1, 1]}
poses:
  dock: [9, 0, 0]
"""


def test_a_tote_may_have_a_size_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "hall.yaml"
    text = catalogue()["warehouse"].read_text(encoding="utf-8")
    own = "slot: 7, colour: red, width: 16 cm, height: 0.12, mass: 1 kg}"
    file.write_text(text.replace("slot: 7, colour: red}", own), encoding="utf-8")
    arena = arenas.load(file)
    one, other = arena.tote("tote_a"), arena.tote("tote_b")
    assert (one.size, one.mass) == ((0.30, 0.16, 0.12), 1.0)
    assert (other.size, other.mass) == ((0.30, 0.24, 0.18), 2.5)
    assert one.T_map_tote.xyz[2] == pytest.approx(0.80 + 0.06)
    file.write_text(text.replace("slot: 7, colour: red}", own.replace("16 cm", "70 cm")), encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"a tote is 0.7 m wide and a slot of rack 'rack_a' 0.6 m"):
        arenas.load(file)


def test_all_faults_of_a_file_are_reported_at_once_with_their_lines(tmp_path: Path) -> None:
    file = tmp_path / "faulty.yaml"
    file.write_text(FAULTY)
    with pytest.raises(ScenarioError) as caught:
        arenas.load(file)
    found = [(problem.line, problem.message) for problem in caught.value.problems]
    expected = [
        (6, "rack 'second' overlaps rack 'first'"),
        (9, "levels of rack 'second' must be 0.28 m apart or more"),
        (10, "a tote is 0.24 m wide and a slot of rack 'second' 0.2 m; slot_spacing must be at least 0.24"),
        (11, "rack 'outside' reaches out of the hall (x -5 to 5, y -5 to 5)"),
        (13, "tote 'one': unknown rack 'frist'; did you mean 'first'?"),
        (16, "tote 'two': rack 'first' has no level 2; valid: 0 to 1"),
        (17, "tote 'two': rack 'first' has no slot 6; valid: 0 to 5"),
        (19, "tote 'four' stands where tote 'three' is"),
        (20, "the name 'first' is already taken in racks"),
        (22, "zone 'start' is inside rack 'first'"),
        (24, "pose 'dock' is outside of the hall"),
    ]
    assert [line for line, _ in found] == [line for line, _ in expected]
    for (_, message), (_, beginning) in zip(found, expected, strict=True):
        assert message.startswith(beginning)


def test_a_misspelt_key_is_named(tmp_path: Path) -> None:
    file = tmp_path / "arena.yaml"
    file.write_text("name: a\nhall: {x: [0, 1], y: [1, 0]}\nraks: {}\n")
    with pytest.raises(
        ScenarioError, match=r"(?s)arena.yaml:2: hall.y must go.*:3: unknown key 'raks'.*did you mean 'racks'"
    ):
        arenas.load(file)


def test_each_bay_has_a_tag_to_the_right_of_its_sign(warehouse: Arena) -> None:
    found = {decal.name: decal for decal in warehouse.decals}
    tags = [name for name in found if " tag " in name]
    assert sorted(int(name.rpartition(" ")[2]) for name in tags) == [
        first + number for first in (100, 200, 300) for number in range(4)
    ]
    for sign, tag in (("1 front", 100), ("2 front", 101), ("1 back", 102), ("2 back", 103)):
        one, other = found[f"rack_a {sign}"], found[f"rack_a tag {tag}"]
        aside = (one.T_body_decal.inverse() @ other.T_body_decal).xyz  # x to the right, y up
        assert aside == pytest.approx([0.16 + 0.05 + 0.08, 0, 0])
        assert other.size == pytest.approx((0.15, 0.15))  # 12 cm, and as much white as a module is wide


@pytest.mark.parametrize(
    ("key", "said"),
    [
        (
            "first_tag: 584",
            "the tags of rack 'rack_b', 584 to 587, are not all of tag36h11; its ids end at 586",
        ),
        (
            "first_tag: 103",
            "the tags of rack 'rack_b', 103 to 106, are also on rack 'rack_a'; choose another",
        ),
        ("first_tag: 200, bay: 60 cm", "a bay of rack 'rack_b' is 0.6 m wide and has no room for a tag"),
    ],
)
def test_tags_that_cannot_be_are_refused_with_their_line(tmp_path: Path, key: str, said: str) -> None:
    file, text = tmp_path / "hall.yaml", catalogue()["warehouse"].read_text(encoding="utf-8")
    file.write_text(text.replace("first_tag: 200", key), encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        arenas.load(file)
    (problem,) = caught.value.problems
    assert (problem.line, problem.message[: len(said)]) == (17, said)


def test_all_that_is_painted_lies_on_what_it_is_painted_on(warehouse: Arena) -> None:
    scene = warehouse.scene(NAMED, seed=1)
    bodies = (*scene.statics, *scene.goods)
    for shape in (shape for body in bodies for shape in body.shapes):
        assert all(0.0 <= share <= 1.0 for share in shape.rgba)
    for body in (body for body in bodies if body.name.endswith("_marking")):
        for stripe in body.shapes:
            assert isinstance(stripe.geometry, Box)
            height = stripe.geometry.size[2]
            assert stripe.T_body_geometry.xyz[2] == pytest.approx(height / 2.0)
            assert height == 0.002
    for good in scene.goods:
        tops = sorted(
            float(shape.T_body_geometry.xyz[2]) + shape.geometry.size[2] / 2.0
            for shape in good.shapes
            if isinstance(shape.geometry, Box)
        )
        assert tops[-1] - tops[-2] >= 0.002 - 1e-12, "the opening shows above the rim"
