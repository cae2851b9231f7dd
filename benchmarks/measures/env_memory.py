"""How much memory a vector environment holds, and whether that grows: a million steps, thousands of episodes.

Resident memory (RSS) at the end of each tenth, in a process of its own for each environment.
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

from benchmarks.measures.env_cost import IDS, drives
from benchmarks.measures.memory import TENTHS, resident_mb


def steps_of(env_id: str, count: int, steps: int) -> tuple[list[float], int]:
    """Take so many steps of single environments; return memory after each tenth [MB], and episodes ended."""
    import gymnasium as gym

    env = gym.make_vec(env_id, num_envs=count, threads=1)
    env.reset(seed=0)
    actions = drives(1000, count)
    found, ends = [], 0
    for step in range(steps // count):
        _, _, terminated, truncated, _ = env.step(actions[step % len(actions)])
        ends += int((terminated | truncated).sum())
        if len(found) < (step + 1) * count * TENTHS // steps:
            found.append(resident_mb())
    env.close()
    return found, ends


def main() -> None:
    """Print one line for each environment."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--envs", type=int, default=64, help="environments of a vector (default: 64)")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of all together (default: 1000000)")
    parser.add_argument("--id", nargs="+", default=IDS, help="which environments (default: both)")
    options = parser.parse_args()
    print(f"resident memory [MB] over {options.steps} steps, after each tenth")
    print(f"{'':24}{''.join(f'{tenth:6}' for tenth in range(1, TENTHS + 1))}{'episodes':>10}")
    for env_id in options.id:
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            found, ends = pool.submit(steps_of, env_id, options.envs, options.steps).result()
        name = env_id.partition(":")[2] or env_id
        print(f"{name:24}{''.join(f'{mb:6.0f}' for mb in found)}{ends:10}", flush=True)


if __name__ == "__main__":
    main()
