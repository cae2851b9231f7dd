"""Kinds of agents: what each of them decides in a scenario. A class and a line here for each."""

from twin.envs.scenario.agents.agent import Agent
from twin.envs.scenario.agents.drive import Drive
from twin.envs.scenario.agents.goals import Goals
from twin.envs.scenario.agents.obstacle import ObstacleAgent
from twin.envs.scenario.agents.tune import Tune

AGENTS: dict[str, type[Agent]] = {"drive": Drive, "goals": Goals, "obstacle": ObstacleAgent, "tune": Tune}
"""By the name that `make_env` takes; add your own."""
