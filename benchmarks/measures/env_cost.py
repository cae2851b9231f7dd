"""What a step of a vector environment costs, as a ratio to its limit: its own physics and rays alone.

The limit is a plain loop over one MjModel and one MjData for each environment, which takes the same models
from the same states by the same controls, and casts the same rays; nothing else, and no threads. It ends in
the same states, to the last bit. Environment and limit take turns every few steps; of each block the best CPU
time of several rounds counts.
"""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import gymnasium as gym
import mujoco
import numpy as np

from twin.envs.gym_envs import NavigationVectorEnv
from twin.envs.simulations import Rows, Simulations
from twin.geometry import Array

IDS = ("twin.envs:twin/DiffDriveGoal-v0", "twin.envs:twin/WarehouseNav-v0")
BLOCK = 5
"""Steps that environment and limit are driven in turns."""
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@dataclass
class Step:
    """What physics and rays there were in one step of all environments."""

    begun: dict[int, tuple[mujoco.MjModel, Array]] = field(default_factory=dict)
    """Of environments that begin an episode before it: model and state."""
    ticks: list[tuple[Array, Array, Array]] = field(default_factory=list)
    """Controls, poses of placed bodies."""
    rays: list[tuple[Sequence[int], Array, Array]] = field(default_factory=list)
    """Which environments cast them, from where, which way; those of new episodes come last."""


class Recorder:
    """Notes what the simulations of an environment do."""

    def __init__(self, simulations: Simulations) -> None:
        self.steps = [Step()]
        self._simulations, batch = simulations, simulations.batch
        self._step, self._ray, self._begin = batch.step, batch.ray, simulations.begin
        self._fresh: set[int] = set()
        batch.step, batch.ray, simulations.begin = self.step, self.ray, self.begin

    def begin(self, i: int, *args) -> None:
        self._begin(i, *args)
        self._fresh.add(i)

    def step(self, **kwargs) -> None:
        batch, now = self._simulations.batch, self.steps[-1]
        for i in sorted(self._fresh):
            now.begun[i] = (batch.get_model(i), batch.state[i].copy())
        self._fresh.clear()
        now.ticks.append((batch.ctrl.copy(), batch.mocap_pos.copy(), batch.mocap_quat.copy()))
        self._step(**kwargs)

    def ray(self, origins: Array, directions: Array, *, ids: Rows | None, **kwargs):
        which = range(self._simulations.count) if ids is None else list(ids)
        self.steps[-1].rays.append((which, origins.copy(), directions.copy()))
        return self._ray(origins, directions, ids=ids, **kwargs)

    def end(self) -> list[Step]:
        batch = self._simulations.batch
        batch.step, batch.ray, self._simulations.begin = self._step, self._ray, self._begin
        return self.steps


class Limit:
    """The same physics and rays again."""

    def __init__(self, simulations: Simulations, steps: list[Step]) -> None:
        self._steps = steps
        self._substeps = simulations._substeps
        self.data = [mujoco.MjData(simulations.model) for _ in range(simulations.count)]
        self._models = [simulations.model] * simulations.count
        self._seen, self._body = simulations.robot.seen, simulations._lidar_body
        self._cutoff = simulations.robot.lidar.range_max
        beams = len(simulations._beams)
        self._geoms, self._distances = np.zeros(beams, np.int32), np.zeros(beams)
        self._moves = simulations.model.nmocap > 0

    def advance(self, first: int, last: int) -> float:
        """Take some of the steps; return the CPU time [s]."""
        taken = 0.0
        for step in self._steps[first:last]:
            for i, (model, state) in step.begun.items():
                self._models[i] = model
                mujoco.mj_setState(model, self.data[i], state, _STATE)
            began = time.process_time()
            self._take(step)
            taken += time.process_time() - began
        return taken

    def _take(self, step: Step) -> None:
        for controls, positions, attitudes in step.ticks:
            for i, (model, data) in enumerate(zip(self._models, self.data, strict=True)):
                data.ctrl[:] = controls[i]
                if self._moves:
                    data.mocap_pos[:] = positions[i]
                    data.mocap_quat[:] = attitudes[i]
                mujoco.mj_step(model, data, self._substeps)
        for which, origins, directions in step.rays:
            for k, i in enumerate(which):
                model, data = self._models[i], self.data[i]
                mujoco.mj_kinematics(model, data)
                mujoco.mj_multiRay(
                    model,
                    data,
                    origins[k, 0],
                    directions[k].reshape(-1),
                    self._seen,
                    True,
                    self._body,
                    self._geoms,
                    self._distances,
                    None,
                    len(self._distances),
                    self._cutoff,
                )


def drives(steps: int, count: int) -> Array:
    """Return actions of agents that mostly drive on, and turn now and then, shape (steps, count, 2)."""
    rng = np.random.default_rng(1)
    turns = np.repeat(rng.uniform(-0.6, 0.6, (steps // 10 + 1, count)), 10, axis=0)[:steps]
    return np.stack((rng.uniform(0.2, 1.0, (steps, count)), turns), axis=2).astype(np.float32)


def measure(env_id: str, count: int, steps: int, rounds: int) -> tuple[float, float, int]:
    """Return CPU time per step of an environment, and of its limit [s], and how many episodes ended."""
    env = gym.make_vec(env_id, num_envs=count, threads=1).unwrapped
    assert isinstance(env, NavigationVectorEnv)
    simulations, actions = env.navigation.simulations, drives(steps, count)
    env.reset(seed=0)
    env.step(actions[0])  # compiles
    recorder = Recorder(simulations)
    env.reset(seed=0)
    recorder.steps[-1].rays.clear()  # those of the first observation are no step's
    ends = 0
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
        ends += int((terminated | truncated).sum())
        recorder.steps.append(Step())
    limit = Limit(simulations, recorder.end())
    best = np.full((2, -(-steps // BLOCK)), np.inf)
    gc.freeze()
    for _ in range(rounds):
        env.reset(seed=0)
        for block, first in enumerate(range(0, steps, BLOCK)):
            last = min(first + BLOCK, steps)
            began = time.process_time()
            for action in actions[first:last]:
                env.step(action)
            best[0, block] = min(best[0, block], time.process_time() - began)
            best[1, block] = min(best[1, block], limit.advance(first, last))
        _compare(simulations, limit)
    gc.unfreeze()
    env.close()
    cost, least = best.sum(axis=1) / (steps * count)
    return float(cost), float(least), ends


def _compare(simulations: Simulations, limit: Limit) -> None:
    """Raise unless the limit came to the same states, where no new episode has begun since."""
    same = [
        np.array_equal(simulations.qpos[i], data.qpos)
        for i, data in enumerate(limit.data)
        if simulations.states.tick[i] > 0
    ]
    if not all(same):
        raise SystemExit(f"the limit did something else in {len(same) - sum(same)} of {len(same)} cases")


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--envs", type=int, default=64, help="environments of a vector (default: 64)")
    parser.add_argument("--steps", type=int, default=100, help="of each (default: 100)")
    parser.add_argument("--rounds", type=int, default=4, help="best of so many (default: 4)")
    parser.add_argument("--id", nargs="+", default=IDS, help="which environments (default: both)")
    options = parser.parse_args()
    print(f"{options.envs} environments, {options.steps} steps, best of {options.rounds}")
    print(f"{'environment':24}{'CPU us per step':>16}{'limit':>8}{'ratio':>7}{'episodes ended':>16}")
    for env_id in options.id:
        cost, limit, ends = measure(env_id, options.envs, options.steps, options.rounds)
        print(
            f"{env_id.partition(':')[2]:24}{cost * 1e6:16.0f}{limit * 1e6:8.0f}{cost / limit:7.3f}{ends:16}"
        )


if __name__ == "__main__":
    main()
