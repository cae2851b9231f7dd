"""Cylinders in arenas: on the map, in the world, and not outside of the hall."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ScenarioError
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED
from twin.warehouse import arena as arenas
from twin.warehouse.arena import Arena
from twin.warehouse.map_renderer import render


def arena(folder: Path, centres: str, poses: str = "{}") -> Arena:
    path = folder / "hall.yaml"
    path.write_text(
        "name: hall\nhall: {x: [-2, 2], y: [-2, 2], walls: false}\n"
        f"cylinders:\n  posts: {{radius: 0.1, height: 0.5, centres: {centres}}}\nposes: {poses}\n"
    )
    return arenas.load(path)


def test_a_map_shows_them_and_no_walls(tmp_path: Path) -> None:
    grid = render(arena(tmp_path, "[[0.5, 0.5], [-1, 0]]"))
    assert grid.value_at([(0.5, 0.5), (0.58, 0.5), (-1.0, 0.08)]).tolist() == [OCCUPIED] * 3
    assert grid.value_at([(0.66, 0.5), (-1.97, 0.0), (0.585, 0.585)]).tolist()[:2] == [FREE, FREE]
    assert not (render(arena(tmp_path, "[[0.5, 0.5]]"), height=0.6).data == OCCUPIED).any()


@pytest.mark.parametrize(
    ("centres", "poses", "words"),
    [
        ("[[0, 0], [1.95, 0]]", "{}", r"hall\.yaml:4: a cylinder of 'posts' at \(1\.95, 0\) reaches out"),
        ("[[0, 0]]", "{start: [0.05, 0, 0]}", "pose 'start' is inside a cylinder of 'posts'"),
    ],
)
def test_what_cannot_be_is_told(tmp_path: Path, centres: str, poses: str, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        arena(tmp_path, centres, poses)
