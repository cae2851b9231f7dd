"""`twin/WarehousePick-v0`; that rules can solve it, `examples/python/pick_tote.py` shows."""

from __future__ import annotations

import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from twin.envs.scenario.pick.lifted import Lifted, LiftedConfig
from twin.geometry import Pose3
from twin.scenario.observation import CheckContext, Held, Observation

EXAMPLE = Path(__file__).parents[3] / "examples" / "python" / "pick_tote.py"


@pytest.fixture
def env() -> Iterator[gym.Env[Any, Any]]:
    made = gym.make("twin.envs:twin/WarehousePick-v0")
    yield made
    made.close()


def end(env: gym.Env[Any, Any], policy: Any, seed: int) -> tuple[dict[str, Any], float]:
    observation, info = env.reset(seed=seed)
    over, total = False, 0.0
    while not over:
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        over, total = terminated or truncated, total + float(reward)
    return info, total


@pytest.mark.long
def test_rules_solve_it_wherever_it_begins(env: gym.Env[Any, Any]) -> None:
    rules = runpy.run_path(str(EXAMPLE))["Rules"]
    picked = [end(env, rules(), seed)[0]["is_success"] for seed in range(20)]
    assert sum(picked) >= 19, picked


@pytest.mark.slow
def test_chance_does_not(env: gym.Env[Any, Any]) -> None:
    env.action_space.seed(0)
    info, total = end(env, lambda _: env.action_space.sample(), 0)
    assert not info["is_success"]
    assert total < 0.0


def test_where_it_begins_depends_on_the_seed_alone(env: gym.Env[Any, Any]) -> None:
    starts = []
    for seed in (1, 2, 1):
        env.reset(seed=seed)
        starts.append(tuple(env.unwrapped.episode.truth))  # type: ignore[attr-defined]
    assert starts[0] == starts[2] != starts[1]
    x, y, yaw = starts[0]
    assert abs(x) <= 0.1 + 1e-6
    assert 1.1 <= 3.6 - y <= 1.4, "before the shelf's edge, which is at y = 3.6 m"
    assert abs(yaw - np.pi / 2) <= 0.1 + 1e-6


def test_every_part_of_an_action_moves_what_it_says(env: gym.Env[Any, Any]) -> None:
    seen, _ = env.reset(seed=1)
    assert seen["grasp"][1] == pytest.approx(-0.6, abs=0.3), "the lift is down"

    def after(*action: float, steps: int = 5) -> dict[str, np.ndarray]:
        for _ in range(steps):
            seen = env.step(np.array(action))[0]
        return seen

    lifted = after(0.0, 0.0, 1.0, 0.0, -1.0)
    assert lifted["grasp"][1] - seen["grasp"][1] == pytest.approx(0.15, abs=0.04), "0.3 m/s for 0.5 s"
    reached = after(0.0, 0.0, 0.0, 1.0, -1.0)
    assert reached["grasp"][0] - seen["grasp"][0] == pytest.approx(0.15, abs=0.04)
    assert reached["gripper"][0] == pytest.approx(0.17, abs=0.01), "open"
    closed = after(0.0, 0.0, 0.0, 0.0, 1.0, steps=12)
    assert closed["gripper"][0] < 0.02
    driven = after(-1.0, 0.0, 0.0, 0.0, 1.0, steps=8)
    assert driven["odom"][3] == pytest.approx(-0.3, abs=0.03)
    assert after(0.0, 1.0, 0.0, 0.0, 1.0, steps=8)["odom"][4] == pytest.approx(0.6, abs=0.1)


def test_lifted_wants_it_up_and_in_a_gripper() -> None:
    def at(z: float, *, held: bool) -> Observation:
        pose = Pose3.from_xyz_rpy((1.0, 2.0, z))
        grasp = {"t": Held(robot="r", T_gripper_good=pose)} if held else {}
        return Observation(time_ns=10**9, goods={"t": pose}, held=grasp)

    check = Lifted("lifted", LiftedConfig(tote="t", by=0.04), CheckContext())
    assert not check.result().passed
    for z, held, reason in (
        (0.8, False, "nobody holds t"),
        (0.83, True, "t is 30 mm above where it stood"),
        (0.9, False, "nobody holds t"),
        (0.9, True, ""),
    ):
        check.observe(at(z, held=held))
        assert (check.result().passed, check.result().reason) == (not reason, reason)
