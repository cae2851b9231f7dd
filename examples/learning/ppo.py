"""Proximal policy optimisation in numpy: two small networks, their gradients by hand, one thread.

The algorithm is that of Schulman et al. (2017), https://arxiv.org/abs/1707.06347, with the details that
Huang et al. (2022) found to matter, https://iclr-blog-track.github.io/2022/03/25/ppo-implementation-details/:
orthogonal weights, normalised observations and advantages, a learning rate that falls to zero, and values
of the last observation where an episode was only cut off.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

Array = np.ndarray


@dataclass(frozen=True, kw_only=True)
class PPOConfig:
    """What is tuned; the defaults learn `twin/DiffDriveGoal-v0`."""

    steps: int = 300_000
    """Steps of all environments together."""
    horizon: int = 128
    """Steps of each environment between two updates."""
    minibatch: int = 2048
    epochs: int = 6
    """How often an update looks at each step."""
    hidden: tuple[int, ...] = (64, 64)
    """Widths of the layers of both networks."""
    learning_rate: float = 1e-3
    """At the start; it falls to zero."""
    gamma: float = 0.99
    """What a reward is worth a step later."""
    gae_lambda: float = 0.95
    """Of generalised advantage estimation, https://arxiv.org/abs/1506.02438."""
    clip: float = 0.2
    """How far the probability of an action may move in one update."""
    entropy: float = 0.0
    """Weight of the entropy of actions in the loss."""
    value_weight: float = 0.5
    log_std: float = -0.5
    """Logarithm of the spread of actions at the start."""
    max_gradient: float = 0.5
    """Norm to which gradients are cut."""


class Network:
    """Layers of tanh with a linear one at the end: (n, inputs) to (n, outputs), float32."""

    def __init__(self, sizes: tuple[int, ...], last_gain: float, rng: np.random.Generator) -> None:
        gains = [math.sqrt(2.0)] * (len(sizes) - 2) + [last_gain]
        layers = zip(sizes[:-1], sizes[1:], gains, strict=True)
        self.weights = [_orthogonal(inputs, outputs, gain, rng) for inputs, outputs, gain in layers]
        self.biases = [np.zeros(b, np.float32) for b in sizes[1:]]

    @property
    def parameters(self) -> list[Array]:
        """The arrays that are learned."""
        return [*self.weights, *self.biases]

    def __call__(self, inputs: Array) -> Array:
        """Return the outputs."""
        return self.forward(inputs)[-1]

    def forward(self, inputs: Array) -> list[Array]:
        """Return what goes into each layer, and the outputs."""
        layers = [inputs]
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            layers.append(np.tanh(layers[-1] @ weight + bias))
        layers.append(layers[-1] @ self.weights[-1] + self.biases[-1])
        return layers

    def backward(self, layers: list[Array], slope: Array) -> list[Array]:
        """Return the gradients of `parameters` of a loss with this slope by the outputs."""
        by_weights: list[Array] = []
        by_biases: list[Array] = []
        for index in reversed(range(len(self.weights))):
            by_weights.append(layers[index].T @ slope)
            by_biases.append(slope.sum(axis=0))
            if index:
                slope = (slope @ self.weights[index].T) * (1.0 - layers[index] ** 2)
        return [*reversed(by_weights), *reversed(by_biases)]


class Normaliser:
    """Mean and variance of all that was seen (Chan's parallel update); makes observations of unit spread."""

    def __init__(self, size: int) -> None:
        self.mean, self.variance, self.count = np.zeros(size), np.ones(size), 1e-4

    def see(self, values: Array) -> None:
        """Take (n, size) into account."""
        mean, variance, n = values.mean(axis=0, dtype=float), values.var(axis=0, dtype=float), len(values)
        apart, total = mean - self.mean, self.count + n
        spread = self.variance * self.count + variance * n + apart**2 * self.count * n / total
        self.mean, self.variance, self.count = self.mean + apart * n / total, spread / total, total

    def __call__(self, values: Array) -> Array:
        """Return the values over their spread, at most 5, as float32."""
        return np.clip((values - self.mean) / np.sqrt(self.variance + 1e-8), -5.0, 5.0).astype(np.float32)


class Policy:
    """What was learned: an action for each observation."""

    def __init__(self, actor: Network, normaliser: Normaliser, log_std: Array) -> None:
        self.actor, self.normaliser, self.log_std = actor, normaliser, log_std

    def __call__(self, observations: Array) -> Array:
        """Return the likeliest actions, in [-1, 1], for (n, size) or (size,) observations."""
        return np.clip(self.actor(self.normaliser(observations)), -1.0, 1.0)

    def save(self, file: Path) -> None:
        """Write it as `.npz`."""
        layers = {f"weight{i}": w for i, w in enumerate(self.actor.weights)}
        layers |= {f"bias{i}": b for i, b in enumerate(self.actor.biases)}
        spread = {"mean": self.normaliser.mean, "variance": self.normaliser.variance}
        np.savez_compressed(file, **layers, **spread, log_std=self.log_std)

    @staticmethod
    def load(file: Path) -> Policy:
        """Read what `save` wrote."""
        with np.load(file) as data:
            layers = sum(name.startswith("weight") for name in data)
            sizes = (*(len(data[f"weight{i}"]) for i in range(layers)), len(data[f"bias{layers - 1}"]))
            actor = Network(sizes, 1.0, np.random.default_rng(0))
            actor.weights = [data[f"weight{i}"] for i in range(layers)]
            actor.biases = [data[f"bias{i}"] for i in range(layers)]
            normaliser = Normaliser(sizes[0])
            normaliser.mean, normaliser.variance = data["mean"], data["variance"]
            return Policy(actor, normaliser, data["log_std"])


class Adam:
    """Kingma and Ba (2015), https://arxiv.org/abs/1412.6980."""

    def __init__(self, parameters: list[Array]) -> None:
        self.parameters, self.step = parameters, 0
        self.first = [np.zeros_like(p) for p in parameters]
        self.second = [np.zeros_like(p) for p in parameters]

    def descend(self, gradients: list[Array], rate: float, most: float) -> None:
        """Move the parameters, after cutting the gradients to a norm of `most`."""
        norm = math.sqrt(sum(float(np.vdot(g, g)) for g in gradients))
        cut = min(1.0, most / (norm + 1e-6))
        self.step += 1
        rate *= math.sqrt(1.0 - 0.999**self.step) / (1.0 - 0.9**self.step)
        for p, g, m, v in zip(self.parameters, gradients, self.first, self.second, strict=True):
            m += 0.1 * (cut * g - m)
            v += 0.001 * ((cut * g) ** 2 - v)
            p -= rate * m / (np.sqrt(v) + 1e-5)


class PPO:
    """Learns in environments of Box observations and Box actions in [-1, 1] that reset in the same step."""

    def __init__(self, envs: gym.vector.VectorEnv, config: PPOConfig, seed: int) -> None:
        self.envs, self.config, self.seed = envs, config, seed
        self.rng = np.random.default_rng(seed)
        inputs, actions = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]
        log_std = np.full(actions, config.log_std, np.float32)
        actor = Network((inputs, *config.hidden, actions), 0.01, self.rng)
        self.policy = Policy(actor, Normaliser(inputs), log_std)
        self.critic = Network((inputs, *config.hidden, 1), 1.0, self.rng)
        self._adam = Adam([*actor.parameters, log_std, *self.critic.parameters])

    def learn(self) -> Iterator[tuple[int, list[dict[str, float]]]]:
        """Learn; after each update yield the steps so far and `final_info` of the episodes that ended.

        The numbers of an episode's last `info` are in it, with `return` and `length`.
        """
        config, envs = self.config, self.envs
        observations, _ = envs.reset(seed=self.seed * 1_000_003)
        batch = config.horizon * envs.num_envs
        updates = max(1, config.steps // batch)
        returns, lengths = np.zeros(envs.num_envs), np.zeros(envs.num_envs, int)
        for update in range(updates):
            observations, rollout, ended = self._collect(observations, returns, lengths)
            self._update(rollout, config.learning_rate * (1.0 - update / updates))
            yield (update + 1) * batch, ended

    def _collect(
        self, observations: Array, returns: Array, lengths: Array
    ) -> tuple[Array, tuple[Array, ...], list[dict[str, float]]]:
        config, envs, policy = self.config, self.envs, self.policy
        shape = (config.horizon, envs.num_envs)
        seen = np.empty((*shape, observations.shape[1]), np.float32)
        actions = np.empty((*shape, len(policy.log_std)), np.float32)
        chances, rewards, values = (np.empty(shape, np.float32) for _ in range(3))
        over = np.empty(shape, bool)
        ended: list[dict[str, float]] = []
        for step in range(config.horizon):
            policy.normaliser.see(observations)
            seen[step] = inputs = policy.normaliser(observations)
            mean = policy.actor(inputs)
            noise = self.rng.standard_normal(mean.shape, dtype=np.float32)
            actions[step] = mean + noise * np.exp(policy.log_std)
            chances[step] = _log_chance(noise, policy.log_std)
            values[step] = self.critic(inputs)[:, 0]
            observations, reward, terminated, truncated, info = envs.step(np.clip(actions[step], -1.0, 1.0))
            rewards[step], over[step] = reward, terminated | truncated
            returns += reward
            lengths += 1
            cut = np.flatnonzero(truncated & ~terminated)
            if len(cut):  # the episode could have gone on: what it was worth yet
                last = np.stack([info["final_obs"][i] for i in cut])
                rewards[step, cut] += config.gamma * self.critic(policy.normaliser(last))[:, 0]
            for i in np.flatnonzero(over[step]):
                numbers = final_numbers(info, i)
                ended.append({**numbers, "return": float(returns[i]), "length": float(lengths[i])})
            returns[over[step]] = lengths[over[step]] = 0
        after = self.critic(policy.normaliser(observations))[:, 0]
        advantages = np.empty(shape, np.float32)
        ahead = np.zeros(envs.num_envs, np.float32)
        for step in reversed(range(config.horizon)):
            goes_on = ~over[step]
            surprise = rewards[step] + config.gamma * after * goes_on - values[step]
            advantages[step] = ahead = surprise + config.gamma * config.gae_lambda * goes_on * ahead
            after = values[step]
        flat = (seen, actions, chances, advantages, advantages + values)
        return observations, tuple(a.reshape(-1, *a.shape[2:]) for a in flat), ended

    def _update(self, rollout: tuple[Array, ...], rate: float) -> None:
        config, n = self.config, len(rollout[0])
        for _ in range(config.epochs):
            order = self.rng.permutation(n)
            for begin in range(0, n, config.minibatch):
                part = order[begin : begin + config.minibatch]
                _, gradients = self.loss(*(each[part] for each in rollout))
                self._adam.descend(gradients, rate, config.max_gradient)

    def loss(
        self, seen: Array, actions: Array, chances: Array, advantages: Array, targets: Array
    ) -> tuple[float, list[Array]]:
        """Return the loss of a batch, and its gradients by the actor, `log_std` and the critic."""
        config, policy, n = self.config, self.policy, len(seen)
        advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        layers, worths = policy.actor.forward(seen), self.critic.forward(seen)
        std = np.exp(policy.log_std)
        noise = (actions - layers[-1]) / std
        ratio = np.exp(_log_chance(noise, policy.log_std) - chances)
        clipped = np.clip(ratio, 1.0 - config.clip, 1.0 + config.clip)
        gain = np.minimum(ratio * advantages, clipped * advantages)
        error = worths[-1][:, 0] - targets
        loss = -gain.mean() + 0.5 * config.value_weight * (error**2).mean()
        loss -= config.entropy * policy.log_std.sum()
        # By log chance: only where the unclipped term is the smaller one does the loss depend on the policy.
        by_chance = (
            np.where(ratio * advantages <= clipped * advantages, -ratio * advantages, 0.0)[:, None] / n
        )
        by_mean = (by_chance * noise / std).astype(np.float32)
        by_log_std = (by_chance * (noise**2 - 1.0)).sum(axis=0) - config.entropy
        by_value = (config.value_weight / n * error)[:, None].astype(np.float32)
        actor, critic = policy.actor.backward(layers, by_mean), self.critic.backward(worths, by_value)
        return float(loss), [*actor, by_log_std.astype(np.float32), *critic]


def episodes(
    envs: gym.vector.VectorEnv, act: Callable[[Array], Array], seeds: list[int]
) -> list[dict[str, float]]:
    """Return the numbers in the last `info` of one episode for each seed; there are as many environments."""
    observations, _ = envs.reset(seed=seeds)
    found: list[dict[str, float]] = [{} for _ in seeds]
    waiting = np.ones(len(seeds), bool)
    while waiting.any():
        observations, _, terminated, truncated, info = envs.step(act(observations))
        for i in np.flatnonzero((terminated | truncated) & waiting):
            found[i] = final_numbers(info, i)
            waiting[i] = False
    return found


def final_numbers(info: dict[str, Any], env: int) -> dict[str, float]:
    """Return the numbers in the last `info` of an environment whose episode has just ended."""
    final = info.get("final_info", {})
    return {k: float(v[env]) for k, v in final.items() if not k.startswith("_") and np.ndim(v) == 1}


def _log_chance(noise: Array, log_std: Array) -> Array:
    return (-0.5 * noise**2 - log_std - 0.5 * math.log(2.0 * math.pi)).sum(axis=1)


def _orthogonal(inputs: int, outputs: int, gain: float, rng: np.random.Generator) -> Array:
    """Return a random matrix of orthogonal columns or rows (Saxe et al., 2014)."""
    q, r = np.linalg.qr(rng.standard_normal((max(inputs, outputs), min(inputs, outputs))))
    q *= np.sign(np.diag(r))
    return np.ascontiguousarray(gain * (q if inputs >= outputs else q.T), np.float32)
