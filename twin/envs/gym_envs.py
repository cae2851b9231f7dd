"""Navigation as gymnasium has it: one environment, and a vector of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from twin.envs.navigation import Navigation, Outcome
from twin.envs.randomisation import Episode
from twin.errors import GymError
from twin.geometry import Array

Observation = NDArray[np.float32]
METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}


class NavigationEnv(gym.Env[Observation, Observation]):
    """One environment."""

    metadata: ClassVar[dict[str, Any]] = METADATA  # type: ignore[misc]

    def __init__(self, navigation: Navigation, render_mode: str | None = None) -> None:
        self.navigation = navigation
        self.render_mode = _known(render_mode)
        self.action_space = navigation.agent.action_space
        self.observation_space = navigation.agent.observation_space
        self._seed = self._episode = -1

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode: with a seed its first one, without the next one."""
        super().reset(seed=seed)
        if seed is not None or self._seed < 0:
            self._seed = int(self.np_random.integers(2**31)) if seed is None else seed
            self._episode = -1
        self._episode += 1
        self.navigation.begin(0, Episode(self._seed, self._episode), options)
        return self.navigation.observe()[0], {"distance": float(self.navigation.distances()[0])}

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for a decision period."""
        if self._episode < 0:
            raise gym.error.ResetNeeded("Cannot call env.step() before calling env.reset()")
        outcome = self.navigation.act(_checked(np.asarray(action)[None], (1, 2)))
        info = {name: values[0].item() for name, values in _info(outcome).items()}
        over = bool(outcome.success[0] or outcome.collision[0])
        return self.navigation.observe()[0], float(outcome.reward[0]), over, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (480, 640, 3), of the present state."""
        return self.navigation.picture(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free what drawing took."""
        self.navigation.close()


class NavigationVectorEnv(VectorEnv[Observation, Observation, NDArray[Any]]):
    """n environments; one that is over begins its next episode within the same step."""

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        **METADATA,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self, navigation: Navigation, max_episode_steps: int | None, render_mode: str | None = None
    ) -> None:
        if max_episode_steps is not None and max_episode_steps < 1:
            raise GymError(f"max_episode_steps is {max_episode_steps}; valid: a whole number from 1 on")
        self.navigation, self.num_envs = navigation, navigation.count
        self.render_mode = _known(render_mode)
        self.single_action_space = navigation.agent.action_space
        self.single_observation_space = navigation.agent.observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._longest = max_episode_steps or np.iinfo(np.int64).max
        self._seeds: list[int] = []
        self._episodes = [-1] * self.num_envs

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin episodes: a number seeds environment i with itself plus i; without one the next episodes."""
        first = seed if isinstance(seed, int | np.integer) else None
        super().reset(seed=None if first is None else int(first))
        self._take_seeds(seed)
        for i in range(self.num_envs):
            self._begin(i, options)
        return self.navigation.observe(), _masked({"distance": self.navigation.distances()})

    def _take_seeds(self, seed: int | Sequence[int | None] | None) -> None:
        given: Sequence[int | None]
        if seed is None:
            given = [None] * self.num_envs
        elif isinstance(seed, int | np.integer):
            given = [int(seed) + i for i in range(self.num_envs)]
        else:
            given = list(seed)
        if len(given) != self.num_envs:
            raise GymError(f"{len(given)} seeds for {self.num_envs} environments; valid: one for each")
        if not self._seeds:
            self._seeds = self.np_random.integers(2**31, size=self.num_envs).tolist()
        for i, value in enumerate(given):
            if value is not None:
                self._seeds[i], self._episodes[i] = int(value), -1

    def _begin(self, i: int, options: Mapping[str, Any] | None = None) -> None:
        self._episodes[i] += 1
        self.navigation.begin(i, Episode(self._seeds[i], self._episodes[i]), options)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Drive for a decision period; who is over then begins anew."""
        if not self._seeds:
            raise gym.error.ResetNeeded("Cannot call env.step() before calling env.reset()")
        outcome = self.navigation.act(_checked(np.asarray(actions), (self.num_envs, 2)))
        terminated = outcome.success | outcome.collision
        truncated = self.navigation.steps >= self._longest
        observations, info = self.navigation.observe(), _masked(_info(outcome))
        over = np.flatnonzero(terminated | truncated)
        if len(over):
            self._begin_anew(over, observations, info)
        return observations, outcome.reward, terminated, truncated, info

    def _begin_anew(self, over: NDArray[np.intp], observations: Observation, info: dict[str, Any]) -> None:
        mask = np.zeros(self.num_envs, np.bool_)
        mask[over] = True
        last = {name: value.copy() for name, value in info.items() if not name.startswith("_")}
        final = np.full(self.num_envs, None, dtype=object)
        for i in over:
            final[i] = observations[i].copy()
            self._begin(int(i))
        info.update(final_obs=final, _final_obs=mask, final_info=_masked(last, mask), _final_info=mask.copy())
        observations[over] = self.navigation.observe(over)
        info["distance"][over] = self.navigation.distances()[over]

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture of each environment, shape (480, 640, 3), in its present state."""
        if self.render_mode != "rgb_array":
            return None
        return tuple(self.navigation.picture(i) for i in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Free what drawing took."""
        self.navigation.close()


def _known(render_mode: str | None) -> str | None:
    if render_mode is not None and render_mode not in METADATA["render_modes"]:
        raise GymError(f"render_mode is {render_mode!r}; valid: {METADATA['render_modes']} or None")
    return render_mode


def _checked(actions: NDArray[Any], shape: tuple[int, ...]) -> Array:
    """Return actions as numbers.

    Raises:
        GymError: They have another shape, or are not finite.
    """
    if actions.shape != shape:
        wanted, given = ("(2,)", actions.shape[1:]) if shape[0] == 1 else (str(shape), actions.shape)
        raise GymError(f"action of shape {given}; valid: {wanted}, linear and angular velocity in [-1, 1]")
    if actions.dtype.kind not in "fiu" or not np.isfinite(actions).all():
        raise GymError(f"action {actions.tolist()} has what is no finite number; valid: [-1, 1]")
    return actions.astype(np.float64)


def _info(outcome: Outcome) -> dict[str, NDArray[Any]]:
    return {
        "is_success": outcome.success,
        "is_collision": outcome.collision,
        "distance": outcome.distance,
    }


def _masked(info: dict[str, NDArray[Any]], mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """Return the infos of a vector with their masks, as `VectorEnv` wants them."""
    full = {}
    for name, values in info.items():
        full[name] = values
        full[f"_{name}"] = np.ones(len(values), np.bool_) if mask is None else mask.copy()
    return full
