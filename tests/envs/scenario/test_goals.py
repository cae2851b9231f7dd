"""An agent that chooses goals: where it sends the mission's own, the run is `twin run`'s."""

from __future__ import annotations

from pathlib import Path

import pytest

import twin
from tests.envs.scenario.conftest import MakeEnv, play
from twin.envs.scenario.agents.goals import Goals
from twin.runtime import run


def test_the_missions_own_goals_give_the_digest_of_twin_run(make: MakeEnv, small: Path) -> None:
    env = make(small, agent="goals")
    info, _ = play(env, lambda _, info: info["mission_action"], seed=7)
    expected = run(twin.load_scenario(small, {"seed": 7}))
    assert info["verdict"]["digest"] == expected.digest
    assert info["verdict"]["checks"] == expected.to_dict()["checks"]
    assert info["is_success"]
    assert info["goals_reached"] == 2


@pytest.mark.parametrize("robot", [pytest.param("a", marks=pytest.mark.slow), "b"])
def test_of_several_robots_too(make: MakeEnv, folder: Path, robot: str) -> None:
    scenario = folder / "two.yaml"
    info, _ = play(make(scenario, agent="goals", robot=robot), lambda _, info: info["mission_action"])
    assert info["verdict"]["digest"] == run(twin.load_scenario(scenario)).digest


@pytest.mark.slow
def test_of_the_warehouse_too(make: MakeEnv) -> None:
    info, _ = play(make("warehouse", agent="goals"), lambda _, info: info["mission_action"])
    assert info["verdict"]["digest"] == run(twin.load_scenario("warehouse")).digest


def test_other_goals_are_driven_to(make: MakeEnv, small: Path) -> None:
    env = make(small, agent="goals")
    env.reset()
    wanted = twin.Pose2(-1.2, -0.6, 1.0)
    assert isinstance(env.agent, Goals)
    _, reward, terminated, _, info = env.step(env.agent.action_for(wanted))
    assert not terminated
    assert info["goals_reached"] == 1, "the mission hears that its goal is reached"
    assert reward > 0.5
    assert env.episode.truth.distance(wanted) < 0.15
    assert info["mission_goal"].tolist() == pytest.approx((-1.0, -0.4, 1.5708), abs=1e-4), "then the next"


def test_a_step_is_from_decision_to_decision(make: MakeEnv, small: Path) -> None:
    env = make(small, agent="goals")
    observation, info = env.reset()
    assert observation["goal"][0] == pytest.approx(0.6, abs=0.1), "0.6 m ahead of the robot"
    assert info["mission_goal"].tolist() == pytest.approx((-0.9, -0.8, 0.0))
    before = info["ticks"]
    info = env.step(info["mission_action"])[-1]
    assert info["ticks"] - before > 50
    assert info["time_s"] == pytest.approx((info["ticks"] - 1) * 0.02)
