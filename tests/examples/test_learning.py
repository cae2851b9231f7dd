"""The programs that learn: their gradients are right, they learn, and what they shipped drives."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

PROGRAMS = Path(__file__).parents[2] / "examples" / "learning"


@pytest.fixture(scope="module")
def ppo() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(PROGRAMS / "ppo.py"), run_name="ppo"))


class Points(gym.vector.VectorEnv[Any, Any, Any]):
    """Points that go to goals on a plane."""

    def __init__(self, count: int) -> None:
        self.num_envs = count
        self.single_observation_space = gym.spaces.Box(-5.0, 5.0, (4,), np.float32)
        self.single_action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.rng = np.random.default_rng(0)
        self.at, self.to, self.age = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros(count, int)

    def _begin(self, which: np.ndarray) -> None:
        self.at[which], self.to[which] = self.rng.uniform(-2.0, 2.0, (2, int(which.sum()), 2))
        self.age[which] = 0

    def _observe(self) -> np.ndarray:
        return np.hstack((self.at, self.to - self.at)).astype(np.float32)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        self._begin(np.ones(self.num_envs, bool))
        return self._observe(), {}

    def step(self, actions: np.ndarray) -> Any:
        before = np.linalg.norm(self.to - self.at, axis=1)
        self.at += 0.1 * actions
        self.age += 1
        after = np.linalg.norm(self.to - self.at, axis=1)
        there, late = after < 0.1, self.age >= 60
        info: dict[str, Any] = {}
        if (there | late).any():
            info = {"final_obs": [*self._observe()], "final_info": {"is_success": there.astype(float)}}
            self._begin(there | late)
        return self._observe(), 5.0 * (before - after) + 5.0 * there, there, late & ~there, info


def test_gradients_are_the_slopes_of_the_loss(ppo: SimpleNamespace) -> None:
    learner = ppo.PPO(Points(2), ppo.PPOConfig(hidden=(5, 4), entropy=0.01), 3)
    policy, rng = learner.policy, np.random.default_rng(1)
    for network in (policy.actor, learner.critic):
        network.weights = [weight.astype(float) for weight in network.weights]
        network.biases = [bias.astype(float) + 0.1 for bias in network.biases]
    policy.log_std = policy.log_std.astype(float)
    seen, actions = rng.normal(size=(40, 4)), rng.normal(size=(40, 2))
    noise = (actions - policy.actor(seen)) / np.exp(policy.log_std)
    chances = -0.5 * noise**2 - policy.log_std - 0.5 * np.log(2.0 * np.pi)
    batch = (seen, actions, chances.sum(axis=1) + 0.3 * rng.normal(size=40), *rng.normal(size=(2, 40)))
    _, gradients = learner.loss(*batch)
    parameters = [*policy.actor.parameters, policy.log_std, *learner.critic.parameters]
    for parameter, gradient in zip(parameters, gradients, strict=True):
        for index in np.ndindex(parameter.shape):
            kept, losses = parameter[index], []
            for step in (1e-5, -1e-5):
                parameter[index] = kept + step
                losses.append(learner.loss(*batch)[0])
            parameter[index] = kept
            assert gradient[index] == pytest.approx((losses[0] - losses[1]) / 2e-5, abs=1e-6)


def test_it_learns_to_go_to_points(ppo: SimpleNamespace) -> None:
    quick = {"horizon": 32, "minibatch": 256, "hidden": (32,), "gamma": 0.9, "learning_rate": 3e-3}
    learner = ppo.PPO(Points(32), ppo.PPOConfig(steps=40_000, **quick), 1)
    ended = [episode for _, episodes in learner.learn() for episode in episodes]
    rates = [np.mean([episode["is_success"] for episode in part]) for part in (ended[:200], ended[-200:])]
    assert rates[0] < 0.6
    assert rates[1] > 0.95


def test_a_policy_is_the_same_after_it_was_written(ppo: SimpleNamespace, tmp_path: Path) -> None:
    learner = ppo.PPO(Points(4), ppo.PPOConfig(steps=512), 2)
    list(learner.learn())
    learner.policy.save(tmp_path / "policy.npz")
    seen = np.random.default_rng(0).normal(size=(7, 4))
    np.testing.assert_array_equal(ppo.Policy.load(tmp_path / "policy.npz")(seen), learner.policy(seen))


def test_what_was_learned_drives_in_an_environment(ppo: SimpleNamespace) -> None:
    import twin.envs  # noqa: F401

    seeds = list(range(1000, 1010))
    envs = gym.make_vec("twin/DiffDriveGoal-v0", num_envs=len(seeds), threads=1)
    policy = ppo.Policy.load(PROGRAMS / "goal.npz")
    found = ppo.episodes(envs, policy, seeds)
    envs.close()
    assert np.mean([episode["is_success"] for episode in found]) >= 0.9


def test_what_was_learned_drives_the_whole_twin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["drive_goal", "--seeds", "3"])
    runpy.run_path(str(PROGRAMS / "drive_goal.py"), run_name="__main__")
    printed = capsys.readouterr().out
    assert "seed 1000: pass" in printed
    assert int(printed.splitlines()[-1].split()[0]) == 3


@pytest.mark.long
def test_it_learns_to_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(PROGRAMS))
    monkeypatch.setattr(sys, "argv", ["learn_goal", "--steps", "50000", "--out", str(tmp_path)])
    runpy.run_path(str(PROGRAMS / "learn_goal.py"), run_name="__main__")
    assert "training seed 0: " in capsys.readouterr().out
    assert (tmp_path / "goal_0.npz").exists()
    assert (tmp_path / "curve.svg").stat().st_size > 5000
