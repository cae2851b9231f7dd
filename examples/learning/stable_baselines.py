"""Learns to drive with stable-baselines3: `python examples/learning/stable_baselines.py 100000`.

`TwinVecEnv` is how any vector environment of gymnasium becomes one of stable-baselines3.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecMonitor


class TwinVecEnv(VecEnv):
    """A vector environment with SAME_STEP autoreset, as stable-baselines3 wants it."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        assert env.metadata["autoreset_mode"] == gym.vector.AutoresetMode.SAME_STEP
        self.env = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Any:
        """Begin, with the seeds of `seed` if there were any."""
        seeds = None if all(seed is None for seed in self._seeds) else list(self._seeds)
        observations, _ = self.env.reset(seed=seeds)
        self._reset_seeds()
        return observations

    def step_async(self, actions: Any) -> None:
        """Take the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Take the step; what gymnasium says of all is said of each."""
        observations, rewards, terminated, truncated, info = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(terminated | truncated):
            infos[i] = {name: values[i] for name, values in info["final_info"].items() if name[0] != "_"}
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return observations, rewards.astype(np.float32), terminated | truncated, infos

    def close(self) -> None:
        """Close the vector environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return what all have in common, once for each."""
        return [getattr(self.env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: the environments are one object."""
        raise NotImplementedError("a vector environment has no attributes of its parts")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Refuse: the environments are one object."""
        raise NotImplementedError("a vector environment has no methods of its parts")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> Sequence[bool]:
        """Return that none is wrapped on its own."""
        return [False] * len(list(self._get_indices(indices)))


def main() -> None:
    """Learn for as many steps as said; print how often the goal was reached in the end."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 200_000
    env = VecMonitor(
        TwinVecEnv(gym.make_vec("twin.envs:twin/DiffDriveGoal-v0", num_envs=32)),
        info_keywords=("is_success",),
    )
    model = PPO("MlpPolicy", env, n_steps=256, batch_size=1024, gamma=0.98, seed=0, device="cpu", verbose=1)
    model.learn(steps)
    reached = [episode["is_success"] for episode in model.ep_info_buffer or ()]
    print(f"goal reached in {100.0 * float(np.mean(reached)):.0f} % of the last {len(reached)} episodes")
    env.close()


if __name__ == "__main__":
    main()
