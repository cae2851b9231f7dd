"""An agent that drives in place of the navigator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.envs.scenario.conftest import MakeEnv, drive_to_goal, play


def test_it_reaches_the_missions_goals(make: MakeEnv, small: Path) -> None:
    env = make(small, "drive", xy_goal_tolerance=0.1, yaw_goal_tolerance=0.3)
    info, reward = play(env, drive_to_goal)
    assert (info["goals_reached"], info["is_success"], info["mission"]) == (2, True, "done")
    assert reward == pytest.approx(2 * 10.0 + 10.0, abs=3.0), "two goals and all checks, some way, some time"
    navigator = env.episode.stack.navigator
    assert navigator is not None
    assert navigator.goals == 0, "no goal reached the navigator"


def test_the_same_actions_give_the_same_run(make: MakeEnv, small: Path) -> None:
    env = make(small)
    steps = [np.array([0.3, 0.5 * np.sin(i)]) for i in range(20)]
    runs = []
    for seed in (5, 5, 6):
        env.reset(seed=seed)
        runs.append(np.array([env.step(action)[0]["scan"] for action in steps]))
    assert (runs[0] == runs[1]).all()
    assert (runs[0] != runs[2]).any(), "another seed has other noise"


def test_a_velocity_goes_the_way_of_a_teleop(make: MakeEnv, small: Path) -> None:
    """Through the multiplexer and the collision monitor, so a wall is not run into."""
    env = make(small, ticks=25)
    env.reset()
    fastest, touched = 0.0, 0.0
    for _ in range(20):
        observation, _, _, _, info = env.step(np.array([-1.0, 0.0]))
        fastest = max(fastest, -float(observation["odom"][3]))
        touched += info["reward_terms"]["collision"]
    assert fastest > 0.3, "it drove back"
    assert touched == 0.0
    assert env.episode.truth.x < -1.9
    env.step(np.array([0.0, 0.0]))
    observation = env.step(np.array([0.0, 0.0]))[0]
    assert abs(observation["odom"][3]) < 0.02


def test_a_long_step_does_not_stop_the_robot(make: MakeEnv, small: Path) -> None:
    """Nobody hears a velocity of half a second ago."""
    env = make(small, ticks=75)
    env.reset()
    observation = env.step(np.array([0.15, 0.0]))[0]
    assert observation["odom"][3] == pytest.approx(0.15, abs=0.02)


def test_the_time_is_up(make: MakeEnv, small: Path) -> None:
    env = make(small, overrides={"duration": "2 s"}, ticks=20)
    env.reset()
    ends = [env.step(np.zeros(2))[2:] for _ in range(5)]
    assert [(terminated, truncated) for terminated, truncated, _ in ends] == [(False, False)] * 4 + [
        (False, True)
    ]
    assert ends[-1][2]["verdict"]["verdict"] == "fail"
    assert ends[-1][2]["time_s"] == pytest.approx(2.0)


def test_one_of_several_robots(make: MakeEnv, folder: Path) -> None:
    env = make(
        folder / "two.yaml",
        robot="b",
        overrides={"duration": "8 s"},
        xy_goal_tolerance=0.1,
        yaw_goal_tolerance=0.5,
    )
    info, _ = play(env, drive_to_goal)
    assert info["goals_reached"] == 1
    assert set(env.observation_space.spaces) == {"age", "goal", "scan", "odom", "amcl_pose"}
