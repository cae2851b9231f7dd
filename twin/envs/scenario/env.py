"""Any scenario file as a `gymnasium.Env`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from twin.envs.scenario.agents import AGENTS
from twin.envs.scenario.agents.agent import Agent, Values
from twin.envs.scenario.episode import Episode
from twin.envs.scenario.observations import Channel
from twin.envs.scenario.observer import Observer
from twin.envs.scenario.own_code import blamed
from twin.envs.scenario.rewards import Reward, require_terms
from twin.envs.scenario.screen import Screen
from twin.errors import GymError, nearest
from twin.savings import uncollected
from twin.scenario.overrides import read_scenario
from twin.scenario.schema import Scenario

NOTHING: Mapping[str, Any] = MappingProxyType({})
_OF_THE_VERDICT = ("scenario", "seed", "verdict", "checks", "digest")
"""What is the same in two equal runs; `episode.verdict` has all."""
_STANDS = {True: "pass", False: "fail", None: "open"}
"""How a check stands, by whether it is decided."""
_SEEDS = 2**31
"""Seeds of runs that are not given are drawn below this."""

if TYPE_CHECKING:
    from twin.recording.live_screen import LiveScreen


class ScenarioEnv(gym.Env[dict[str, Values], Values]):
    """One agent in a run; what it does not do, the robot's own nodes do.

    A step lasts `ticks` control periods, or until the agent is asked again. The run ends as that of
    `twin run` does: `terminated` when its mission is over (after the second in which a run lets things
    settle) or its checks end it early, `truncated` when its time is up. Then
    `info` has the verdict, with the digest of the run.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"]}  # noqa: RUF012  gymnasium's own type

    def __init__(
        self,
        scenario: Scenario | str | Path | None = None,
        agent: str | type[Agent] = "drive",
        *,
        robot: str | None = None,
        observe: Sequence[str | Channel] | None = None,
        reward: Mapping[str, float] | None = None,
        ticks: int | None = None,
        overrides: Mapping[str, Any] = NOTHING,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **settings: Any,
    ) -> None:
        """Build the run once, to see what there is to observe and to do; see `make_env`.

        Raises:
            TwinError: The scenario cannot be run, or is no environment for this agent.
        """
        if not isinstance(scenario, Scenario | str | Path):
            raise GymError(f"scenario is {scenario!r}; valid: scenario=... with the name or file of one")
        self._kind = agent_of(agent)
        self._config = config_of(self._kind, settings)
        if not isinstance(robot, str | None):
            raise GymError(f"robot={robot!r}: valid is the name of one of the scenario's")
        if not isinstance(overrides, Mapping):
            raise GymError(f"overrides={overrides!r}: valid are keys of the scenario with values")
        self._file, self._overrides = scenario, dict(overrides)
        self._robot, self._wanted = robot, observe
        self._weights = require_terms(self._kind.rewards if reward is None else reward)
        self._ticks = self._kind.ticks if ticks is None else ticks
        if not (isinstance(self._ticks, int) and self._ticks >= min(1, self._kind.ticks)):
            raise GymError(f"ticks={ticks!r}: valid is a whole number of control periods, 1 or more")
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            valid = ", ".join(self.metadata["render_modes"])
            raise GymError(f"there is no render_mode '{render_mode}'; valid: {valid}")
        self.render_mode = render_mode
        self._screen = Screen(render_mode, width, height)
        self._read = read_scenario(scenario, self._overrides)
        self._episode: Episode | None = None
        self._over = False
        self._begin(self._read, None)  # to see what there is
        assert self._episode is not None
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / self._episode.step_s))}
        self.observation_space, self.action_space = self._observer.space, self._agent.action_space
        self._end()

    # -- gymnasium -------------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Values], dict[str, Any]]:
        """Begin a new run, and go on to the agent's first decision.

        Args:
            seed: Of all noise of the run: that of `twin run --seed`. None: first the scenario's own, then
                ever another one, drawn from the last that was given.
            options: Dotted keys of the scenario -> values for this run only, as `overrides`.

        Raises:
            TwinError: The run cannot be made, its spaces are others, or the agent is never asked.
        """
        if options is not None and not isinstance(options, Mapping):
            raise GymError(
                f"the options of reset are {options!r}; valid are keys of the scenario with values"
            )
        first = self._np_random is None
        super().reset(seed=self._read.seed if first and seed is None else seed)
        if seed is None:
            seed = self._read.seed if first else int(self.np_random.integers(_SEEDS))
        scenario = self._read
        if options:
            scenario = read_scenario(self._file, {**self._overrides, **options})
        self._begin(scenario.model_copy(update={"seed": seed}), self._screen.live)
        spaces: list[gym.Space[Any]] = [self._observer.space, self._agent.action_space]
        if spaces != [self.observation_space, self.action_space]:
            self._end()
            raise GymError(
                f"the options of reset change the spaces of the environment of '{scenario.name}'; "
                "make another environment with them as overrides"
            )
        self._advance(1)
        episode = self._episode
        assert episode is not None
        if episode.over:
            self._over = True
            raise GymError(
                f"the run of '{scenario.name}' was over after {episode.time:g} s before its agent had "
                f"anything to decide: its mission was '{episode.parts.mission.state}'"
            )
        self._reward = Reward(episode, self._weights)
        return self._observer.observe(), self._info()

    def step(self, action: Values) -> tuple[dict[str, Values], float, bool, bool, dict[str, Any]]:
        """Act, and go on to the next decision or the end of the run.

        Raises:
            GymError: The action is none, or there is no run.
            TwinError: The run cannot go on.
        """
        episode = self._episode
        if episode is None or self._over:
            raise GymError("the run is over, or has not begun; call reset()")
        checked = self._checked(action)
        with blamed(self._kind, "act"):
            self._agent.act(checked)
        self._advance(self._ticks)
        self._over = episode.over
        terms = self._reward.terms()
        info = self._info()
        info["reward_terms"] = terms
        if episode.verdict is not None:
            verdict = episode.verdict.to_dict()
            info["verdict"] = {name: verdict[name] for name in _OF_THE_VERDICT}
            info["is_success"] = episode.verdict.exit_code == 0
        in_time = episode.parts.mission.done or episode.time < episode.scenario.duration - 1e-9
        reward, over = sum(terms.values()), episode.over
        return self._observer.observe(), reward, over and in_time, over and not in_time, info

    def render(self) -> Any:
        """Return a picture of the robot from above, shape (height, width, 3), if the mode is `rgb_array`.

        Raises:
            GymError: There is no run, or this computer can draw nothing.
        """
        return self._screen.draw(self.episode)

    def close(self) -> None:
        """End the run, and the viewer. Harmless when repeated."""
        self._end()
        self._screen.close()

    # -- inside ----------------------------------------------------------------------------------------------

    @property
    def page_url(self) -> str | None:
        """Address of the viewer in a browser; None without one, or if it has a window of its own."""
        return self._screen.page_url

    @property
    def agent(self) -> Agent:
        """The agent of the run under way."""
        return self._agent

    @property
    def episode(self) -> Episode:
        """The run under way: its nodes, its world, its mission.

        Raises:
            GymError: There is none.
        """
        if self._episode is None:
            raise GymError("there is no run; call reset()")
        return self._episode

    def _end(self) -> None:
        if self._episode is not None:
            self._episode.close()
            self._episode = None

    def _begin(self, scenario: Scenario, screen: LiveScreen | None) -> None:
        self._end()
        self._over = False
        with uncollected():
            with blamed(self._kind, "prepared"):
                prepared = self._kind.prepared(scenario, self._config)
            self._episode = episode = Episode(prepared, self._robot, ticks=self._ticks, screen=screen)
            try:
                with blamed(self._kind, "the beginning"):
                    self._agent = self._kind(episode, self._config)
                self._observer = Observer(episode, self._agent, self._wanted)
            except BaseException:
                self._end()
                raise

    def _advance(self, ticks: int) -> None:
        """Go on for so many ticks, and until the agent is asked."""
        episode, agent = self.episode, self._agent

        def asks() -> bool:
            with blamed(self._kind, "asks"):
                return agent.asks()

        if ticks == 0 and asks():
            return
        left = ticks

        def due() -> bool:
            nonlocal left
            left -= 1
            with blamed(self._kind, "watch"):
                agent.watch()
            return left <= 0 and asks()

        try:
            episode.advance(due)
        except BaseException:
            self._end()  # a tick that was broken off cannot be resumed
            raise

    def _checked(self, action: Any) -> Values:
        """Return an action within the bounds.

        Raises:
            GymError: It has another shape, or is not finite.
        """
        space = self._agent.action_space
        try:
            values = np.asarray(action, dtype=space.dtype)
        except (TypeError, ValueError):
            raise GymError(f"the action {action!r} is no array of numbers; valid is {space}") from None
        if values.shape != space.shape:
            raise GymError(f"the action has the shape {values.shape}; valid is {space.shape}")
        if not np.isfinite(values).all():
            raise GymError(f"the action {values} is not finite; valid is {space}")
        return np.clip(values, space.low, space.high)

    def _info(self) -> dict[str, Any]:
        episode = self.episode
        goal = episode.task.goal
        return {
            "time_s": episode.time,
            "ticks": episode.ticks,
            "mission": episode.parts.mission.state,
            "mission_goal": np.array((0.0, 0.0, 0.0) if goal is None else goal),
            "has_goal": goal is not None,
            "goals_reached": episode.task.reached,
            "checks": {check.name: _STANDS[check.decided] for check in episode.run.checks},
            **self._agent.info(),
        }


def agent_of(agent: str | type[Agent]) -> type[Agent]:
    """Return a kind of agent by its name.

    Raises:
        GymError: There is none of that name.
    """
    if isinstance(agent, type) and issubclass(agent, Agent):
        return agent
    if (name := str(agent)) not in AGENTS:
        raise GymError(f"there is no agent '{name}'; {nearest(name, AGENTS)}")
    return AGENTS[name]


def config_of(kind: type[Agent], settings: Mapping[str, Any]) -> Any:
    """Return an agent's configuration.

    Raises:
        GymError: It has no such setting, or needs another.
    """
    names = [field.name for field in fields(kind.Config)]
    for name in settings:
        if name not in names:
            more = ("agent", "observe", "overrides", "render_mode", "reward", "robot", "ticks")
            said = nearest(name, [*names, *more])
            raise GymError(f"an environment of the agent {kind.__name__} has no setting '{name}'; {said}")
    needed = [f.name for f in fields(kind.Config) if f.default is MISSING and f.name not in settings]
    if needed:
        raise GymError(
            f"an environment of the agent {kind.__name__} needs the setting {', '.join(needed)}=..."
        )
    try:
        return kind.Config(**settings)
    except (TypeError, ValueError) as error:
        raise GymError(f"the settings of the agent {kind.__name__} are refused: {error}") from error
