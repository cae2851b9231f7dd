"""Learn to drive to a point past boxes: `python examples/learning/learn_goal.py --out learned`."""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: small matrices are faster in one thread

import gymnasium as gym
import numpy as np
from ppo import PPO, Policy, PPOConfig, episodes

import twin.envs  # noqa: F401  registers the environments

HELD_OUT = range(1000, 1100)
"""Seeds of rooms that training never sees."""


def environments(count: int, threads: int = 1) -> gym.vector.VectorEnv:
    """Return so many rooms, each with a robot of its own."""
    return gym.make_vec("twin/DiffDriveGoal-v0", num_envs=count, threads=threads)


def success(policy: Policy, seeds: range = HELD_OUT) -> float:
    """Return the share of seeds whose goal the policy reaches, without noise in its actions."""
    envs = environments(len(seeds))
    rate = np.mean([episode["is_success"] for episode in episodes(envs, policy, list(seeds))])
    envs.close()
    return float(rate)


def learn(seed: int, config: PPOConfig) -> tuple[Policy, list[tuple[float, float, float]], float]:
    """Return what was learned; steps, success and return along the way; and the CPU time that it took [s]."""
    envs = environments(64)
    began, curve = time.process_time(), []
    ppo, recent = PPO(envs, config, seed), []
    for steps, ended in ppo.learn():
        recent = (recent + ended)[-400:]
        if recent:
            rate = float(np.mean([episode["is_success"] for episode in recent]))
            curve.append((float(steps), rate, float(np.mean([episode["return"] for episode in recent]))))
    envs.close()
    return ppo.policy, curve, time.process_time() - began


def plot(curves: list[list[tuple[float, float, float]]], file: Path) -> None:
    """Draw success over steps, a line for each training seed."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7.0, 3.6), layout="constrained")
    for number, curve in enumerate(curves):
        steps, rates, _ = np.array(curve).T
        axes.plot(steps / 1e6, 100.0 * rates, label=f"training seed {number}", linewidth=1.2)
    axes.axhline(90.0, color="grey", linestyle=":", linewidth=1.0)
    axes.set(xlabel="million steps", ylabel="goals reached [%]", ylim=(0.0, 100.0), xlim=(0.0, None))
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", loc="lower right")
    figure.savefig(file)
    pyplot.close(figure)


def main() -> None:
    """Learn with each seed, and tell how well each drives where it has never been."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="how many times to learn")
    parser.add_argument("--steps", type=int, default=PPOConfig.steps, help="steps of all environments")
    parser.add_argument("--out", type=Path, default=Path("learned"), help="folder of policies and curve")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    curves = []
    for seed in range(arguments.seeds):
        policy, curve, cpu_s = learn(seed, PPOConfig(steps=arguments.steps))
        policy.save(arguments.out / f"goal_{seed}.npz")
        curves.append(curve)
        print(f"training seed {seed}: {100.0 * success(policy):.0f} % of held-out seeds, {cpu_s:.0f} CPU-s")
        plot(curves, arguments.out / "curve.svg")


if __name__ == "__main__":
    main()
