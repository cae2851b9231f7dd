"""An agent that chooses goals: where the navigator drives, in place of the mission's own choice."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from twin.envs.scenario.agents.agent import Values
from twin.envs.scenario.agents.navigating import NavigatingAgent
from twin.envs.scenario.episode import Episode
from twin.geometry import Pose2


class Goals(NavigatingAgent):
    """Sends the goals of the mission's nodes to `navigate_to_pose`, the mission's own or others.

    An action is a pose in `map`, of 64 bits: x, y and yaw, each from -1 to 1 between the ends of the map
    and of a turn. A step lasts from one decision to the next. `info["mission_action"]` is the action that
    the mission itself would take: it sends the mission's own message, and with nothing but these the run is
    `twin run`'s to the last bit. The mission hears of each result as of its own goal's.
    """

    ticks: ClassVar[int] = 0
    observes: ClassVar[tuple[str, ...]] = ("odom", "amcl_pose")
    rewards: ClassVar[Mapping[str, float]] = {"goals": 1.0, "checks": 10.0, "time": 0.01}

    def __init__(self, episode: Episode, config: Any) -> None:
        super().__init__(episode, config)
        (x0, y0), (x1, y1) = episode.ground
        self._middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0])
        self._half = np.array([(x1 - x0) / 2.0, (y1 - y0) / 2.0, math.pi])
        self.action_space = spaces.Box(-1.0, 1.0, (3,), np.float64)

    def act(self, action: Values) -> None:
        """Send the goal that waits."""
        last = self.episode.task.last
        assert last is not None
        own = np.array_equal(action, self.action_for(last.pose))
        pose = last.pose if own else Pose2(*(self._middle + action * self._half).tolist())
        last.send(pose, self.episode.stack.frames.map)

    def info(self) -> dict[str, Values]:
        """Return the mission's own decision; zeros when there is none to take."""
        goal = self.episode.task.goal
        return {"mission_action": np.zeros(3) if goal is None else self.action_for(goal)}

    def action_for(self, pose: Pose2) -> Values:
        """Return the action that sends the robot to a pose in `map`."""
        return np.clip((np.array(pose) - self._middle) / self._half, -1.0, 1.0)
