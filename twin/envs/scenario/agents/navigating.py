"""What agents have in common that take the mission's goals over."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.envs.scenario.agents.agent import Agent, Values
from twin.envs.scenario.episode import Episode
from twin.errors import GymError
from twin.geometry import Pose2


class NavigatingAgent(Agent):
    """Is asked when the mission has a goal, and shown it as the robot sees it."""

    def __init__(self, episode: Episode, config: Any) -> None:
        super().__init__(episode, config)
        if not episode.task.is_set:
            scenario = episode.scenario
            kinds = ", ".join(dict.fromkeys(task.type for task in scenario.tasks))
            raise GymError(
                f"the scenario '{scenario.name}' has no goal for robot '{episode.stack.name}': its mission "
                f"({kinds}) sends none to navigate_to_pose; valid are missions that do, such as behaviors "
                "with a step navigate_to_pose, random_goals, explore or pick_and_place"
            )
        episode.task.holding = True

    def asks(self) -> bool:
        """Return whether a goal waits."""
        last = self.episode.task.last
        return last is not None and last.waits

    def observation_spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return that of the goal."""
        (x0, y0), (x1, y1) = self.episode.ground
        far = math.hypot(x1 - x0, y1 - y0)
        high = np.array([far, far, math.pi], np.float32)
        return {"goal": spaces.Box(-high, high, dtype=np.float32)}

    def observe(self) -> dict[str, Values]:
        """Return the goal's x, y [m] and yaw [rad] from where the robot believes to be; zeros without one."""
        return {"goal": np.array(self._ahead() or (0.0, 0.0, 0.0))}

    def _ahead(self) -> Pose2 | None:
        goal, here = self.episode.task.goal, self.episode.belief
        return None if goal is None or here is None else here.inverse() @ goal
