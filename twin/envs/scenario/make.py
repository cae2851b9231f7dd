"""How scenario environments are made: one, several at a time, and by gymnasium's registry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym

from twin.envs import SCENARIO
from twin.envs.scenario.env import NOTHING, ScenarioEnv
from twin.runtime import end_threads

if TYPE_CHECKING:
    from twin.envs.scenario.agents.agent import Agent
    from twin.envs.scenario.observations import Channel
    from twin.scenario.schema import Scenario


def make_env(
    scenario: Scenario | str | Path,
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
) -> ScenarioEnv:
    """Make a gymnasium environment of a scenario: the agent does one part, the robot's nodes do the rest.

    Args:
        scenario: Its name or file, or what `load_scenario` returned.
        agent: `drive`: velocities; `goals`: where the navigator drives; `tune`: live parameters of nodes;
            `obstacle`: where an obstacle goes; or a class of your own.
        robot: Which one it is about; None: the only one, or the only one with a mission.
        observe: Topics that are shown, or channels as `Scan("/scan", beams=36)`; None: what suits the agent.
        reward: Weights of the terms; None: what suits the agent.
        ticks: Control periods of a step; None: what suits the agent.
        overrides: Dotted keys of the file -> values that go before its own.
        render_mode: `rgb_array`, `human`, or None.
        width: Of pictures [pixels].
        height: Of pictures [pixels].
        **settings: Of the agent: fields of its `Config`.

    Raises:
        TwinError: The scenario cannot be run, or is no environment for this agent.
    """
    if isinstance(overrides, Mapping):
        overrides = dict(overrides)
    options = locals()  # a proxy could not be told to another process
    options |= options.pop("settings")
    made = ScenarioEnv(**options)
    made.spec = replace(gym.spec(SCENARIO), kwargs=options)
    return made


def make_vec_env(
    scenario: Scenario | str | Path,
    agent: str | type[Agent] = "drive",
    *,
    num_envs: int = 1,
    vectorization_mode: str = "async",
    vector_kwargs: Mapping[str, Any] = NOTHING,
    **options: Any,
) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Make several environments that are stepped together, each in a process of its own.

    Each of them gives what a single one gives with the same seed.

    Args:
        scenario: As for `make_env`.
        agent: As for `make_env`.
        num_envs: How many.
        vectorization_mode: `async`: processes; `sync`: one after the other in this one.
        vector_kwargs: Of gymnasium's `AsyncVectorEnv` or `SyncVectorEnv`, such as `{"context": "spawn"}`.
        **options: All others of `make_env`.

    Raises:
        TwinError: As `make_env`.
    """
    end_threads()  # processes may be forked
    return gym.make_vec(
        SCENARIO,
        num_envs,
        vectorization_mode,
        vector_kwargs=dict(vector_kwargs),
        scenario=scenario,
        agent=agent,
        **options,
    )
