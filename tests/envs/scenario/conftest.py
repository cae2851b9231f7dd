"""A small hall in which a small robot has two goals."""

from __future__ import annotations

from pathlib import Path

import pytest

ARENA = """
name: arena
hall: {x: [-2.5, 2.5], y: [-2, 2], wall_height: 0.6}
pillars:
  pillar: {pose: [0.6, 0.9, 30 deg]}
poses:
  start: [-1.5, -1.0, 0]
"""
SMALL = """
name: small
seed: 3
duration: 60 s
world: {arena: ./arena.yaml}
robots:
  - {model: diff_bot, start: start, localisation: {type: amcl}, navigation: {}}
mission:
  type: behaviors
  robot: diff_bot
  steps:
    - navigate_to_pose: {x: -0.9 m, y: -0.8 m}
    - navigate_to_pose: {x: -1.0 m, y: -0.4 m, yaw: 90 deg}
checks:
  - mission_succeeded:
  - no_collision:
"""
TWO = """
name: two
seed: 3
duration: 60 s
world: {arena: ./arena.yaml}
robots:
  - {model: diff_bot, name: a, start: start, localisation: {type: amcl}, navigation: {}}
  - {model: diff_bot, name: b, pose: {x: 1.5, y: 1.2}, localisation: {type: amcl}, navigation: {}}
missions:
  - {type: behaviors, robot: a, steps: [{navigate_to_pose: {x: -1.1 m, y: -0.9 m}}]}
  - {type: behaviors, robot: b, steps: [{navigate_to_pose: {x: 1.8 m, y: 1.1 m}}]}
checks:
  - mission_succeeded:
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return where the scenarios `small.yaml` and `two.yaml` are."""
    for name, text in (("arena", ARENA), ("small", SMALL), ("two", TWO)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path


@pytest.fixture
def small(folder: Path) -> Path:
    """Return the scenario of one robot."""
    return folder / "small.yaml"
