"""A small hall in which a small robot has two goals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import twin
from twin.envs.scenario.env import ScenarioEnv

MakeEnv = Callable[..., ScenarioEnv]

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
WALK = """
name: walk
seed: 3
duration: 30 s
world:
  arena: ./arena.yaml
  obstacles:
    - {name: walker, pose: {x: -0.6, y: -0.75}, size: [0.3, 0.3, 1.0], yields_within: 0.4}
robots:
  - {model: diff_bot, start: start, localisation: {type: amcl}, navigation: {}}
mission: {type: behaviors, robot: diff_bot, steps: [{navigate_to_pose: {x: 0.0 m, y: -1.0 m}}]}
checks:
  - mission_succeeded:
  - no_collision:
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return where the scenarios `small.yaml`, `two.yaml` and `walk.yaml` are."""
    for name, text in (("arena", ARENA), ("small", SMALL), ("two", TWO), ("walk", WALK)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path


@pytest.fixture
def small(folder: Path) -> Path:
    """Return the scenario of one robot."""
    return folder / "small.yaml"


@pytest.fixture
def make() -> Iterator[MakeEnv]:
    """Return `twin.make_env`; what it makes is closed at the end."""
    made: list[ScenarioEnv] = []

    def make_env(*args: Any, **options: Any) -> ScenarioEnv:
        made.append(twin.make_env(*args, **options))
        return made[-1]

    yield make_env
    for env in made:
        env.close()


Policy = Callable[[Mapping[str, np.ndarray], Mapping[str, Any]], Any]


def play(env: ScenarioEnv, policy: Policy, seed: int | None = None) -> tuple[dict[str, Any], float]:
    """Play to the end; return the last info, and the sum of rewards."""
    observation, info = env.reset(seed=seed)
    over, total = False, 0.0
    while not over:
        observation, reward, terminated, truncated, info = env.step(policy(observation, info))
        assert env.observation_space.contains(observation)
        assert terminated or truncated or "verdict" not in info
        over, total = terminated or truncated, total + reward
    return info, total


def drive_to_goal(observation: Mapping[str, np.ndarray], info: Mapping[str, Any]) -> np.ndarray:
    """Turn to the goal, drive, and turn as it says."""
    x, y, yaw = observation["goal"].tolist()
    distance, heading = np.hypot(x, y), np.arctan2(y, x)
    if distance < 0.03:
        return np.array([0.0, np.clip(2.0 * yaw, -1.0, 1.0)])
    forward = np.clip(distance, 0.05, 0.5) * max(0.0, np.cos(heading))
    return np.array([forward, np.clip(1.5 * heading, -1.0, 1.0)])
