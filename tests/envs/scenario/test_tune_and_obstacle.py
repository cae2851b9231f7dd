"""Agents that set parameters, or play an obstacle, while the robot does its work."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.envs.scenario.conftest import MakeEnv, play

SPEED = "controller_server:FollowPath.desired_linear_vel"


def test_a_tuned_parameter_changes_how_the_robot_drives(make: MakeEnv, small: Path) -> None:
    env = make(small, "tune", parameters={SPEED: (0.1, 0.4)})
    driven = []
    for action in (-1.0, 1.0):
        env.reset()
        for _ in range(3):
            env.step(np.array([action]))
        driven.append(env.episode.truth.x + 1.5)
    assert driven[1] > 1.6 * driven[0] > 0.1, "in 3 s at 0.4 m/s, and at 0.1 m/s"


def test_the_values_are_shown(make: MakeEnv, small: Path) -> None:
    env = make(
        small, "tune", parameters={SPEED: (0.2, 0.4), "planner_server:smoother.max_its": (20, 60)}, ticks=5
    )
    observation, _ = env.reset()
    for value in (-1.0, 0.0, 1.0):
        observation = env.step(np.array([value, value]))[0]
        assert observation["parameters"] == pytest.approx([value, value])
    nodes = {node.name: node for node in env.episode.run.bus.nodes}
    assert nodes["planner_server"].get_parameter("smoother.max_its").value == 60
    assert nodes["controller_server"].get_parameter("FollowPath.desired_linear_vel").value == pytest.approx(
        0.4
    )


def test_somebody_stands_in_the_way(make: MakeEnv, folder: Path) -> None:
    env = make(folder / "walk.yaml", "obstacle", ticks=10)
    away, of_away = play(env, lambda _, __: np.array([0.0, 1.0]))

    def stay_before_it(seen: dict[str, np.ndarray], _: object) -> np.ndarray:
        x, y, yaw = seen["robot"].tolist()
        return np.clip(3.0 * np.array([x + 0.7 * np.cos(yaw), y + 0.7 * np.sin(yaw)]), -1.0, 1.0)

    blocked, of_blocked = play(env, stay_before_it)
    assert away["is_success"]
    assert {check["name"]: check["passed"] for check in blocked["verdict"]["checks"]}["no_collision"], (
        "it comes no nearer than people do"
    )
    assert blocked["time_s"] > away["time_s"] + 1.0
    assert of_blocked > of_away, "which is what an obstacle is paid for"


def test_it_does_not_leave_its_place(make: MakeEnv, folder: Path) -> None:
    env = make(folder / "walk.yaml", "obstacle", reach=0.4)
    env.reset()
    offsets = [env.step(np.array([1.0, 0.3]))[0]["offset"] for _ in range(15)]
    assert offsets[0] == pytest.approx([0.04, 0.012], abs=1e-6), "0.5 m/s from the first tick to the fifth"
    assert offsets[-1] == pytest.approx([0.4, 0.222], abs=0.051)
    back = env.step(np.array([-1.0, 0.0]))[0]["offset"]
    assert back[0] < offsets[-1][0]
