"""What all scenario environments have in common: seeds, options, spaces, vectors, mistakes."""

from __future__ import annotations

import ctypes
import gc
import hashlib
import os
import pickle
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics

import twin
from tests.envs.scenario.conftest import MakeEnv
from twin.envs.scenario.agents.drive import Drive
from twin.envs.scenario.env import ScenarioEnv
from twin.envs.scenario.rewards import TERMS, Term
from twin.errors import GymError

TUNE = {"parameters": {"controller_server:FollowPath.desired_linear_vel": (0.1, 0.4)}}


def first_of(env: ScenarioEnv, seed: int | None = None) -> str:
    """Return a hash of the first observation."""
    observation, _ = env.reset(seed=seed)
    return hashlib.sha256(b"".join(observation[key].tobytes() for key in sorted(observation))).hexdigest()


def step_once(env: ScenarioEnv) -> None:
    """Begin a run, and decide once."""
    env.reset()
    env.step(env.action_space.sample())


def resident() -> int:
    """Return what the process holds [bytes], without what is free already and only kept for later."""
    gc.collect()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_every_run_of_a_seed_begins_alike(make: MakeEnv, small: Path) -> None:
    env = make(small)
    seeds = {seed: first_of(env, seed) for seed in range(3)}
    assert len(set(seeds.values())) == 3
    assert all(first_of(env, seed) == seeds[seed] for seed in (2, 0, 1, 0))


def test_without_a_seed_the_first_run_is_the_files(make: MakeEnv, small: Path) -> None:
    envs = [make(small), make(small)]
    runs = [[first_of(env), first_of(env), first_of(env, 3), first_of(env)] for env in envs]
    assert runs[0] == runs[1], "nothing is left to chance"
    first, second, given, after = runs[0]
    assert first == given, "the file's seed is 3"
    assert len({first, second, after}) >= 2
    assert second != first


@pytest.mark.long
@pytest.mark.timeout(900)
def test_hundreds_of_runs_begin_alike_and_leave_nothing(make: MakeEnv, small: Path) -> None:
    env = make(small)
    seeds = {seed: first_of(env, seed) for seed in range(5)}
    after = []
    for i in range(400):
        assert first_of(env, i % 5) == seeds[i % 5]
        if i % 40 == 39:
            after.append(resident())
    assert after[-1] - after[1] < 4e6, after


def test_options_change_one_run(make: MakeEnv, small: Path) -> None:
    env = make(small, "goals")
    goal = {"mission.steps.0.navigate_to_pose": {"x": 1.0, "y": 0.5, "yaw": "90 deg"}}
    assert env.reset(options=goal)[1]["mission_goal"].tolist() == pytest.approx([1.0, 0.5, np.pi / 2])
    assert env.reset()[1]["mission_goal"].tolist() == pytest.approx([-0.9, -0.8, 0.0])


def test_checks_that_end_a_run_terminate_it(make: MakeEnv, small: Path) -> None:
    checks = [{"never": "x > -1.45"}]
    env = make(small, overrides={"checks": checks, "early_stop": "failed"}, ticks=20)
    assert list(env.reset()[1]["checks"].values()) == ["open"]
    for _ in range(20):
        _, _, terminated, truncated, info = env.step(np.array([0.4, 0.0]))
        if terminated or truncated:
            break
    assert (terminated, truncated) == (True, False)
    assert list(info["checks"].values()) == ["fail"]
    assert info["time_s"] < 4.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "options"),
    [
        ("small", {}),
        ("small", {"agent": "goals"}),
        ("small", {"agent": "tune", **TUNE}),
        ("walk", {"agent": "obstacle"}),
    ],
)
def test_gymnasium_has_nothing_to_say(
    make: MakeEnv, folder: Path, scenario: str, options: dict[str, Any]
) -> None:
    check_env(make(folder / f"{scenario}.yaml", **options), skip_render_check=True)


@pytest.mark.slow
def test_gymnasium_has_nothing_to_say_of_picking() -> None:
    env = gym.make("twin.envs:twin/WarehousePick-v0")
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_gymnasiums_wrappers_fit(small: Path) -> None:
    env = gym.make("twin.envs:twin/Scenario-v0", scenario=small, observe=["/scan", "/odom"])
    wrapped = RecordEpisodeStatistics(FlattenObservation(env))
    assert wrapped.reset(seed=1)[0].shape == (360 + 5 + 2 + 3,)
    assert wrapped.step(wrapped.action_space.sample())[0].dtype == np.float32
    wrapped.close()


@pytest.mark.parametrize("context", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_several_in_processes_are_what_one_is(make: MakeEnv, small: Path, context: str) -> None:
    actions = np.array([[0.4, 0.2], [0.3, -0.4]], np.float32)
    one, single = make(small), []
    for seed, action in ((5, actions[0]), (6, actions[1])):
        one.reset(seed=seed)
        steps = [one.step(action) for _ in range(3)]
        single.append((steps[-1][0]["scan"], [step[1] for step in steps]))
    one.close()
    several = twin.make_vec_env(small, num_envs=2, vector_kwargs={"context": context})
    try:
        several.reset(seed=[5, 6])
        steps = [several.step(actions) for _ in range(3)]
    finally:
        several.close()
    for i, (scan, rewards) in enumerate(single):
        assert (steps[-1][0]["scan"][i] == scan).all()
        assert [step[1][i] for step in steps] == rewards


def test_what_an_environment_is_made_of_can_be_pickled(make: MakeEnv, small: Path) -> None:
    env = make(small, "tune", **TUNE)
    again = pickle.loads(pickle.dumps(env.spec)).make()
    assert again.observation_space == env.observation_space
    again.close()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"agent": "drve"}, "there is no agent 'drve'; did you mean 'drive'?"),
        ({"agent": "tune"}, "an environment of the agent Tune needs the setting parameters=..."),
        ({"agent": "tune", "parameters": {}}, "the agent tune has no parameters"),
        ({"agent": "tune", "parameters": {"x": (0, 1)}}, "the parameter 'x' has no node"),
        (
            {"agent": "tune", "parameters": {"amcI:x": (0, 1)}},
            "there is no node /amcI in 'small'; did you mean",
        ),
        ({"agent": "tune", "parameters": {"amcl:x": (0, 1)}}, "the node /amcl has no 'x'"),
        (
            {"agent": "tune", "parameters": {"controller_server:controller_plugins": (0, 1)}},
            "is of type STRING_ARRAY",
        ),
        (
            {"agent": "tune", "parameters": {"planner_server:smoother.max_its": (5, 2)}},
            "valid are finite ones, low before high",
        ),
        ({"agent": "tune", "parameters": {"planner_server:smoother.max_its": 3}}, "valid is .low, high."),
        (
            {"agent": "tune", "parameters": {"planner_server:smoother.max_its": (-5, 2)}},
            "max_its' are -5 and 2; valid is 1 … 5000",
        ),
        ({"agent": "tune", "parameters": {"amcl:max_beams": (20, 60)}}, "'amcl:max_beams' is read-only"),
        ({"agent": "obstacle"}, "the scenario 'small' has no obstacle in world.obstacles to play"),
        ({"colour": 3}, "an environment of the agent Drive has no setting 'colour'"),
        ({"observe": ["/scn"]}, "the scenario 'small' has no topic /scn; did you mean '/scan'?"),
        ({"observe": ["/odom.pose"]}, "/odom.pose has no bounds; valid is Field"),
        ({"observe": ["/tf"]}, "/tf carries tf2_msgs/msg/TFMessage, of which fields can be shown"),
        ({"observe": ["scan", "/scan"]}, "two parts of the observation are called 'scan'"),
        ({"agent": int}, "there is no agent '<class 'int'>'; "),
        ({"agent": ["drive"]}, r"there is no agent '\['drive'\]'"),
        ({"reward": {"prgress": 1}}, "there is no reward 'prgress'; did you mean 'progress'?"),
        ({"reward": {"progress": "much"}}, "the reward 'progress' has the weight 'much'; valid is a finite"),
        ({"reward": {"progress": float("nan")}}, "has the weight nan; valid is a finite number"),
        ({"reward": ["progress"]}, "valid are names of terms with weights"),
        ({"observe": "/scan"}, "observe='/scan': valid is a list of topics or channels"),
        ({"observe": [5]}, "valid is a list of topics or channels"),
        ({"overrides": 5}, "overrides=5: valid are keys of the scenario with values"),
        ({"robot": 5}, "robot=5: valid is the name"),
        ({"agent": "tune", "parameters": 3}, "the agent tune has no parameters; valid is"),
        ({"ticks": 0}, "ticks=0: valid is a whole number of control periods, 1 or more"),
        ({"ticks": 1.5}, "ticks=1.5: valid"),
        ({"robot": "b"}, "the scenario 'small' has no robot 'b'"),
        ({"render_mode": "ansi"}, "there is no render_mode 'ansi'; valid: rgb_array, human"),
        ({"overrides": {"duraton": 3}}, "unknown key 'duraton'; did you mean 'duration'?"),
    ],
)
def test_a_mistake_is_one_sentence(small: Path, options: dict[str, Any], said: str) -> None:
    with pytest.raises(twin.TwinError, match=said) as raised:
        twin.make_env(small, **options)
    assert len(str(raised.value).splitlines()) == 1


def test_what_is_wrong_in_a_term_or_agent_of_ones_own_is_told_with_its_line(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Cold(Term):
        def value(self) -> float:
            raise ValueError("too cold")

    class Lazy(Drive):
        def act(self, action: Any) -> None:
            raise ZeroDivisionError

    class Deaf(Drive):
        def asks(self) -> bool:
            raise KeyError("nobody")

    monkeypatch.setitem(TERMS, "cold", Cold)
    for options, said in (
        ({"reward": {"cold": 1.0}}, r"test_env\.py:\d+: the reward of Cold fails: ValueError: too cold"),
        ({"agent": Lazy}, r"test_env\.py:\d+: act of Lazy fails: ZeroDivisionError"),
        ({"agent": Deaf}, r"test_env\.py:\d+: asks of Deaf fails: KeyError: 'nobody'"),
    ):
        with twin.make_env(small, **options) as env, pytest.raises(GymError, match=said):
            step_once(env)


@pytest.mark.parametrize(
    ("mission", "kind"),
    [
        ("{type: idle}", "idle"),
        ("{type: behaviors, robot: diff_bot, steps: [{spin: {angle: 1}}]}", "behaviors"),
    ],
)
def test_a_scenario_without_a_goal_is_no_environment(small: Path, mission: str, kind: str) -> None:
    overrides = {"mission": mission, "checks": "[{driven_distance: {max: 1 m}}]"}
    with pytest.raises(GymError, match=rf"has no goal for robot 'diff_bot': its mission \({kind}\)"):
        twin.make_env(small, overrides=overrides)


def test_of_several_robots_one_has_to_be_named(folder: Path) -> None:
    with pytest.raises(
        GymError, match=r"several robots; say which one the agent is about with robot=\.\.\.: a, b"
    ):
        twin.make_env(folder / "two.yaml")


def test_without_a_scenario_it_is_one_sentence() -> None:
    with pytest.raises(GymError, match=r"scenario is None; valid: scenario=\.\.\. with the name or file"):
        gym.make("twin.envs:twin/Scenario-v0")


def test_times_are_those_of_whole_nanoseconds(make: MakeEnv, small: Path) -> None:
    env = make(small, ticks=5)
    env.reset()
    times = [env.step(np.zeros(2))[4]["time_s"] for _ in range(4)]
    assert times == [round(time, 9) for time in times], "such as 0.3, not 0.30000000000000004"


def test_a_wrong_action_is_one_sentence_and_the_run_goes_on(make: MakeEnv, small: Path) -> None:
    env = make(small)
    with pytest.raises(GymError, match=r"the run is over, or has not begun; call reset\(\)"):
        env.step(np.zeros(2))
    env.reset()
    for action, said in (
        ([np.nan, 0.0], "is not finite"),
        ([0.0, -np.inf], "is not finite"),
        ([0.0] * 3, r"has the shape \(3,\); valid is \(2,\)"),
        ([[0.0, 0.0]], r"has the shape \(1, 2\)"),
        ("north", "is no array of numbers"),
        ({"v": 1.0}, "is no array of numbers"),
        (None, r"shape \(\)"),
    ):
        with pytest.raises(GymError, match=said):
            env.step(action)  # type: ignore[arg-type]
    env.step(np.array([9.0, 0.0]))  # as much as there is


def test_options_that_change_the_spaces_are_refused(make: MakeEnv, small: Path) -> None:
    env = make(small)
    with pytest.raises(
        GymError, match="the options of reset change the spaces of the environment of 'small'"
    ):
        env.reset(options={"duration": "30 s"})
    with pytest.raises(GymError, match="the options of reset are 3; valid are keys of the scenario"):
        env.reset(options=3)  # type: ignore[arg-type]
    with pytest.raises(GymError, match="call reset"):
        env.step(np.zeros(2))
    env.reset()


def test_a_run_that_is_over_before_the_agent_is_asked(make: MakeEnv, small: Path) -> None:
    steps = [{"wait": {"duration": "3 s"}}, {"navigate_to_pose": {"x": 0.0, "y": 0.0}}]
    env = make(small, overrides={"mission.steps": steps, "duration": "1 s"})
    with pytest.raises(GymError, match=r"was over after 1 s before its agent had anything to decide"):
        env.reset()


def test_a_closed_environment_holds_nothing(make: MakeEnv, small: Path) -> None:
    env = make(small)
    env.reset()
    bus = env.episode.run.bus
    env.close()
    env.close()
    assert bus.wire.is_closed
    with pytest.raises(GymError, match="there is no run"):
        _ = env.episode
    env.reset()
