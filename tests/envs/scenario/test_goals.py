"""An agent that chooses goals: where it sends the mission's own, the run is `twin run`'s."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import twin
from twin.envs.scenario.agents.goals import Goals
from twin.envs.scenario.env import ScenarioEnv
from twin.runtime import run


def play(env: ScenarioEnv, seed: int | None = None) -> dict[str, Any]:
    """Send the mission's own goals to the end."""
    _, info = env.reset(seed=seed)
    over = False
    while not over:
        _, _, terminated, truncated, info = env.step(info["mission_action"])
        over = terminated or truncated
    return info


def test_the_missions_own_goals_give_the_digest_of_twin_run(small: Path) -> None:
    env = twin.make_env(small, agent="goals")
    for seed in (None, 7):
        info = play(env, seed)
        expected = run(twin.load_scenario(small, {} if seed is None else {"seed": seed}))
        assert info["verdict"]["digest"] == expected.digest
        assert info["verdict"]["checks"] == expected.to_dict()["checks"]
        assert info["is_success"]
        assert info["goals_reached"] == 2


@pytest.mark.parametrize("robot", ["a", "b"])
def test_of_several_robots_too(folder: Path, robot: str) -> None:
    scenario = folder / "two.yaml"
    env = twin.make_env(scenario, agent="goals", robot=robot)
    assert play(env)["verdict"]["digest"] == run(twin.load_scenario(scenario)).digest


@pytest.mark.slow
@pytest.mark.parametrize(("name", "digest"), [("warehouse", "eebd6b51ec6b")])
def test_of_a_shipped_scenario_too(name: str, digest: str) -> None:
    assert play(twin.make_env(name, agent="goals"))["verdict"]["digest"].startswith(digest)


def test_other_goals_are_driven_to(small: Path) -> None:
    env = twin.make_env(small, agent="goals")
    env.reset()
    wanted = twin.Pose2(-1.2, -0.6, 1.0)
    assert isinstance(env.agent, Goals)
    _, reward, terminated, _, info = env.step(env.agent.action_for(wanted))
    assert not terminated
    assert info["goals_reached"] == 1, "the mission hears that its goal is reached"
    assert reward > 0.5
    assert env.episode.truth.distance(wanted) < 0.15
    assert np.hypot(*(info["mission_goal"][:2] - (-1.0, -0.4))) < 1e-9
    env.close()


def test_a_step_is_from_decision_to_decision(small: Path) -> None:
    env = twin.make_env(small, agent="goals")
    observation, info = env.reset()
    assert np.allclose(info["mission_goal"], (-0.9, -0.8, 0.0))
    assert observation["goal"][0] == pytest.approx(0.6, abs=0.1), "0.6 m ahead"
    before = info["ticks"]
    info = env.step(info["mission_action"])[-1]
    assert info["ticks"] - before > 50
    assert info["time_s"] == pytest.approx((info["ticks"] - 1) * 0.02)
    env.close()
