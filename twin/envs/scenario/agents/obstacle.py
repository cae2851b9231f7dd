"""An agent that plays an obstacle: somebody who walks where he likes, before a robot that does its work."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from twin.envs.scenario.agents.agent import Agent, Values, unit_box
from twin.envs.scenario.episode import Episode
from twin.errors import GymError, nearest
from twin.scenario.schema import Scenario


class ObstacleAgent(Agent):
    """Moves one of `world.obstacles`.

    An action is its velocity along x and y of the world as part of its `speed`, from -1 to 1. It comes no
    nearer to robots than those that walk by themselves do (`yields_within`), goes through walls and shelves
    but no further than `reach` from its start, and sees the truth: it is part of the world.
    """

    @dataclass(frozen=True, kw_only=True)
    class Config:
        """Which one, and how far it may go."""

        obstacle: str | None = None
        """Its name; None: the only one."""
        reach: float = 2.0
        """How far it goes from where it starts, along x and along y [m]."""

    observes: ClassVar[tuple[str, ...]] = ()
    rewards: ClassVar[Mapping[str, float]] = {"goals": -10.0, "checks": -10.0, "time": -0.1}

    def __init__(self, episode: Episode, config: Config) -> None:
        super().__init__(episode, config)
        self.action_space = unit_box(2)
        self._steered = episode.run.obstacles.steer(_named(episode.scenario, config.obstacle))
        self._start = self._steered.pose

    @classmethod
    def prepared(cls, scenario: Scenario, config: Config) -> Scenario:
        """Return the scenario with an obstacle that walks, as far as its start.

        Raises:
            GymError: It has none of that name, or one that cannot walk.
        """
        name = _named(scenario, config.obstacle)
        obstacles = []
        for each in scenario.world.obstacles:
            if each.name == name:
                if each.mass is not None or each.appears_within is not None:
                    raise GymError(
                        f"the obstacle '{name}' of '{scenario.name}' is pushed, or appears: an agent can "
                        "play one that has neither mass nor appears_within"
                    )
                here = each.pose.pose
                each = each.model_copy(update={"route": ((here.x, here.y),)})
            obstacles.append(each)
        world = scenario.world.model_copy(update={"obstacles": tuple(obstacles)})
        return scenario.model_copy(update={"world": world})

    def act(self, action: Values) -> None:
        """Walk on, not out of reach."""
        speed, here, start = self._steered.obstacle.speed, self._steered.pose, self._start
        out = np.abs((here.x - start.x, here.y - start.y)) >= self.config.reach
        back = np.sign((here.x - start.x, here.y - start.y)) != np.sign(action)
        vx, vy = np.where(out & ~back, 0.0, speed * action).tolist()
        self._steered.velocity = vx, vy

    def observation_spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return those of where it is, and of the robot."""
        (x0, y0), (x1, y1) = self.episode.ground
        far, reach = math.hypot(x1 - x0, y1 - y0), 2.0 * self.config.reach
        robot, offset = np.array([far, far, math.pi], np.float32), np.full(2, reach, np.float32)
        return {
            "offset": spaces.Box(-offset, offset, dtype=np.float32),
            "robot": spaces.Box(-robot, robot, dtype=np.float32),
        }

    def observe(self) -> dict[str, Values]:
        """Return how far it is from its start [m], and the robot's x, y [m], yaw [rad] from it, in truth."""
        here, start, robot = self._steered.pose, self._start, self.episode.truth
        return {
            "offset": np.array([here.x - start.x, here.y - start.y]),
            "robot": np.array([robot.x - here.x, robot.y - here.y, robot.yaw]),
        }


def _named(scenario: Scenario, name: str | None) -> str:
    names = [obstacle.name for obstacle in scenario.world.obstacles]
    if name is None and len(names) == 1:
        return names[0]
    if name not in names:
        if not names:
            raise GymError(f"the scenario '{scenario.name}' has no obstacle in world.obstacles to play")
        said = nearest(name or "", names)
        raise GymError(f"say which obstacle of '{scenario.name}' the agent is, with obstacle=...: {said}")
    return name
