"""A robot in a room that it does not know: it explores, saves, goes on, and finds itself in what it saved."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from twin.errors import MapError
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.runtime import run
from twin.runtime.build import build
from twin.scenario.schema import Scenario, load

pytestmark = pytest.mark.xdist_group("explored")

ROOM = """\
name: room
seed: 3
duration: 120 s
world:
  obstacles:
    - {name: south, size: [8.2, 0.1, 0.5], pose: {x: 0, y: -3.05}}
    - {name: north, size: [8.2, 0.1, 0.5], pose: {x: 0, y: 3.05}}
    - {name: west, size: [0.1, 6.0, 0.5], pose: {x: -4.05, y: 0}}
    - {name: east, size: [0.1, 6.0, 0.5], pose: {x: 4.05, y: 0}}
    - {name: divider, size: [0.1, 3.5, 0.5], pose: {x: 0.5, y: -1.25}}
    - {name: crate, size: [0.6, 0.4, 0.5], pose: {x: -2.0, y: 1.8, yaw: 20 deg}}
robots:
  - model: warehouse_bot
    pose: {x: -2.5, y: -1.5}
    localisation: LOCALISATION
    navigation: {}
mission: MISSION
checks: [CHECKS]
"""
EXPLORE = "{type: explore, robot: warehouse_bot}"
Make = Callable[[str], Scenario]


@pytest.fixture(scope="module")
def explored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Explore the room once; return the folder of the run."""
    folder = tmp_path_factory.mktemp("room")
    file = folder / "room.yaml"
    text = ROOM.replace("LOCALISATION", "{type: slam}").replace("MISSION", EXPLORE)
    checks = (
        "{mission_succeeded: }, {map_accuracy: {mean: 3 cm, p95: 5 cm}}, {no_collision: }, "
        "{map_coverage: {floor: 0.95, walls: 0.95}}, {localisation_error: {rms: 3 cm}}"
    )
    file.write_text(text.replace("CHECKS", checks), encoding="utf-8")
    verdict = run(load(file), out=folder, record=False)
    assert verdict.verdict == "pass", [(c.name, c.value, c.reason) for c in verdict.checks]
    return folder


def test_it_explores_the_room_and_leaves_map_and_graph_beside_the_verdict(explored: Path) -> None:
    grid = OccupancyMap.load(explored / "map.yaml")
    assert grid.width * grid.resolution == pytest.approx(8.1, abs=0.3)
    assert (grid.data == 100).sum() > 300
    assert (explored / "map.posegraph").stat().st_size > 1000


def test_it_finds_itself_in_the_graph_that_it_saved(scenario: Make, explored: Path) -> None:
    graph = explored / "map.posegraph"
    text = ROOM.replace(
        "LOCALISATION",
        f"{{type: slam, mode: localization, pose_graph: {graph}, "
        "initial_pose_error: {xy: 20 cm, yaw: 5 deg}}",
    )
    steps = "[{navigate_to_pose: {x: -1.5, y: 0.3}}, {navigate_to_pose: {x: 2.5, y: 0}}]"
    text = text.replace("MISSION", f"{{type: behaviors, robot: warehouse_bot, steps: {steps}}}")
    checks = "{mission_succeeded: }, {localisation_error: {rms: 3 cm, after: 1 s}}, {no_collision: }"
    verdict = run(scenario(text.replace("CHECKS", checks)), record=False)
    assert verdict.verdict == "pass", [(c.name, c.value, c.reason) for c in verdict.checks]


def test_it_goes_on_with_a_map_made_before(scenario: Make, explored: Path, tmp_path: Path) -> None:
    text = ROOM.replace("LOCALISATION", f"{{type: slam, pose_graph: {explored / 'map.posegraph'}}}")
    steps = "[{navigate_to_pose: {x: -2.0, y: 0.3, yaw: 90 deg}}]"
    text = text.replace("MISSION", f"{{type: behaviors, robot: warehouse_bot, steps: {steps}}}")
    checks = "{map_accuracy: {p95: 5 cm}}, {map_coverage: {floor: 0.95}}, {localisation_error: {rms: 3 cm}}"
    verdict = run(scenario(text.replace("CHECKS", checks)), out=tmp_path / "out", record=False)
    assert verdict.verdict == "pass", [(c.name, c.value, c.reason) for c in verdict.checks]
    longer, before = (p / "map.posegraph" for p in (tmp_path / "out", explored))
    assert longer.stat().st_size > before.stat().st_size


def test_a_graph_that_is_not_there_is_named(scenario: Make) -> None:
    text = ROOM.replace("LOCALISATION", "{type: slam, pose_graph: none.posegraph}")
    text = text.replace("MISSION", "{type: idle}").replace("CHECKS", "{no_collision: }")
    with pytest.raises(MapError, match=r"none\.posegraph"):
        build(scenario(text))


def test_two_robots_map_one_room_each_in_its_namespace(scenario: Make, tmp_path: Path) -> None:
    text = ROOM.replace("LOCALISATION", "{type: slam}").replace("CHECKS", "{no_collision: }")
    first = text[text.index("  - model") : text.index("mission:")]
    both = first.replace("- model", "- name: left\n    model") + first.replace(
        "- model: warehouse_bot\n    pose: {x: -2.5, y: -1.5}",
        "- name: right\n    model: warehouse_bot\n    pose: {x: 2.5, y: 0, yaw: 90 deg}",
    )
    text = text.replace(first, both).replace("120 s", "20 s")
    steps = "[{wait: {duration: 1 s}}, {navigate_to_pose: {x: 2.5, y: 1.0, yaw: 90 deg}}]"
    text = text.replace("MISSION", f"{{type: behaviors, robot: right, steps: {steps}}}")
    checks = "{localisation_error: {robot: right, rms: 3 cm}}, {localisation_error: {robot: left, rms: 3 cm}}"
    text = text.replace("{no_collision: }", f"{{no_collision: }}, {{mission_succeeded: }}, {checks}")
    verdict = run(scenario(text), out=tmp_path / "out", record=False)
    assert verdict.verdict == "pass", [(c.name, c.value, c.reason) for c in verdict.checks]
    left, right = (OccupancyMap.load(tmp_path / "out" / f"{name}_map.yaml") for name in ("left", "right"))
    behind_the_divider = (3.0, 0.5)
    assert right.value_at(behind_the_divider) == 0
    assert left.value_at(behind_the_divider) == -1
