"""Navigation as gymnasium has it: one environment, and a vector of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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
_FPS = 10


class NavigationEnv(gym.Env[Observation, Observation]):
    """One environment."""

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": ["human", "rgb_array"],
        "render_fps": _FPS,
    }

    def __init__(self, navigation: Navigation, render_mode: str | None = None) -> None:
        self.navigation = navigation
        self.render_mode = _known(render_mode, self.metadata)
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
        if self.render_mode == "human":
            self.navigation.begin_showing()
        return self.navigation.observe()[0], {"distance": float(self.navigation.distances()[0])}

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for a decision period."""
        if self._episode < 0:
            raise gym.error.ResetNeeded("Cannot call env.step() before calling env.reset()")
        outcome = self.navigation.act(_checked(action, 2))
        if self.render_mode == "human":
            self.navigation.show()
        info = {name: values[0].item() for name, values in _info(outcome).items()}
        over = bool(outcome.success[0] or outcome.collision[0])
        return self.navigation.observe()[0], float(outcome.reward[0]), over, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (480, 640, 3), of the present state; `human` shows each step by itself."""
        return self.navigation.picture(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free what drawing took, and end the viewer."""
        self.navigation.close()


class NavigationVectorEnv(VectorEnv[Observation, Observation, NDArray[Any]]):
    """n environments; one that is over begins its next episode within the same step."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": _FPS}  # noqa: RUF012

    def __init__(
        self,
        navigation: Navigation,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    ) -> None:
        """Take n environments.

        Args:
            navigation: They.
            max_episode_steps: An episode is truncated after so many; None: never.
            render_mode: `rgb_array` or None.
            autoreset_mode: When one that is over begins its next episode: within the same step, in the next
                one (as some of gymnasium's wrappers want it), or, where it is disabled, when it is reset.

        Raises:
            GymError: One of them is wrong.
        """
        if max_episode_steps is not None and max_episode_steps < 1:
            raise GymError(f"max_episode_steps is {max_episode_steps}; valid: a whole number from 1 on")
        self.navigation, self.num_envs = navigation, navigation.count
        self.render_mode = _known(render_mode, self.metadata)
        self._mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self._mode}
        self._over = np.zeros(self.num_envs, np.bool_)
        self.single_action_space = navigation.agent.action_space
        self.single_observation_space = navigation.agent.observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._longest = max_episode_steps or np.iinfo(np.int64).max
        self._seeds: list[int] = []
        self._episodes = [-1] * self.num_envs
        self._observations = np.zeros(self.observation_space.shape or (), np.float32)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin episodes: a number seeds environment i with itself plus i; without one the next episodes.

        Args:
            seed: One, or one for each environment (None: go on with that which it has).
            options: `start` and `goal` for all, as of one environment; `reset_mask`, shape (n,): only where
                it is True an episode begins, the observations of the others are as they were.
        """
        options = dict(options or {})
        which = self._chosen(options.pop("reset_mask", None))
        first = int(seed) if isinstance(seed, int | np.integer) else None
        super().reset(seed=first)
        self._take_seeds(seed, which)
        for i in which:
            self._begin(int(i), options)
        self._over[which] = False
        self._observations[which] = self.navigation.observe(which)
        return self._observations.copy(), _masked({"distance": self.navigation.distances()})

    def _chosen(self, mask: Any) -> NDArray[np.intp]:
        if mask is None:
            return np.arange(self.num_envs)
        if not self._seeds:
            raise GymError("option 'reset_mask' of a first reset; valid: from the second reset on")
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise GymError(f"option 'reset_mask' is {mask!r}; valid: {self.num_envs} booleans in an array")
        return np.flatnonzero(mask)

    def _take_seeds(self, seed: int | Sequence[int | None] | None, which: NDArray[np.intp]) -> None:
        if seed is None:
            given: list[Any] = [None] * self.num_envs
        elif isinstance(seed, int | np.integer):
            given = [int(seed) + i for i in range(self.num_envs)]
        else:
            given = list(seed) if isinstance(seed, Iterable) else [seed]
        wrong = [s for s in given if s is not None and not (isinstance(s, int | np.integer) and s >= 0)]
        if wrong:
            raise GymError(f"seed {wrong[0]!r}; valid: a whole number from 0 on")
        if len(given) != self.num_envs:
            raise GymError(f"{len(given)} seeds for {self.num_envs} environments; valid: one for each")
        if not self._seeds:
            self._seeds = self.np_random.integers(2**31, size=self.num_envs).tolist()
        for i in which:
            if (value := given[i]) is not None:
                self._seeds[i], self._episodes[i] = int(value), -1

    def _begin(self, i: int, options: Mapping[str, Any] | None = None) -> None:
        self._episodes[i] += 1
        self.navigation.begin(i, Episode(self._seeds[i], self._episodes[i]), options)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Drive for a decision period; who is over begins anew as the autoreset mode says."""
        if not self._seeds:
            raise gym.error.ResetNeeded("Cannot call env.step() before calling env.reset()")
        checked, ended = _checked(actions, self.num_envs, 2), self._over
        if self._mode == AutoresetMode.DISABLED and ended.any():
            which = int(np.argmax(ended))
            raise GymError(f"environment {which} is over; valid: reset it, with option 'reset_mask'")
        outcome = self.navigation.act(checked)
        for i in np.flatnonzero(ended):
            self._begin(int(i))
            outcome.clear(int(i), self.navigation.distances()[i])
        terminated = outcome.success | outcome.collision
        truncated = self.navigation.steps >= self._longest
        observations, info = self.navigation.observe(), _masked(_info(outcome))
        self._over = terminated | truncated
        if self._mode == AutoresetMode.SAME_STEP and self._over.any():
            self._begin_anew(np.flatnonzero(self._over), observations, info)
            self._over = np.zeros(self.num_envs, np.bool_)
        self._observations = observations
        return observations.copy(), outcome.reward, terminated, truncated, info

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


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        valid = ", ".join(mode.value for mode in AutoresetMode)
        raise GymError(f"autoreset_mode is {mode!r}; valid: {valid}") from None


def _known(render_mode: str | None, metadata: Mapping[str, Any]) -> str | None:
    if render_mode is not None and render_mode not in metadata["render_modes"]:
        valid = ", ".join(metadata["render_modes"])
        raise GymError(f"render_mode is {render_mode!r}; valid: {valid}, or None")
    return render_mode


_VALID = "linear and angular velocity, each in [-1, 1]"


def _checked(given: ArrayLike, *shape: int) -> Array:
    """Return actions of a shape as numbers, shape (n, 2); what is beyond [-1, 1] counts as there.

    Raises:
        GymError: They have another shape, or are not finite.
    """
    try:
        actions = np.asarray(given)
    except ValueError:
        raise GymError(f"the action {given!r} is no array; valid: {_VALID}") from None
    if actions.shape != shape:
        raise GymError(f"actions have shape {actions.shape}; valid: {shape}, of {_VALID}")
    if actions.dtype.kind not in "fiu":
        raise GymError(f"actions are of type {actions.dtype}; valid: numbers, of {_VALID}")
    actions = actions.reshape(-1, 2)
    finite = np.isfinite(actions).all(axis=1)
    if not finite.all():
        which = int(np.argmin(finite))
        raise GymError(f"the action of environment {which} is {actions[which].tolist()}; valid: {_VALID}")
    return actions.astype(np.float64)


def _info(outcome: Outcome) -> dict[str, NDArray[Any]]:
    return {"is_success": outcome.success, "is_collision": outcome.collision, "distance": outcome.distance}


def _masked(info: dict[str, NDArray[Any]], mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """Return the infos of a vector with their masks, as `VectorEnv` wants them."""
    full = {}
    for name, values in info.items():
        full[name] = values
        full[f"_{name}"] = np.ones(len(values), np.bool_) if mask is None else mask.copy()
    return full
