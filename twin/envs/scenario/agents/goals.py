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

    An action is a pose in `map`: x, y [m], yaw [rad], of 64 bits. A step lasts from one decision to the
    next, and takes the mission's message as it is if the pose is exactly that of `info["mission_goal"]`:
    then the run is `twin run`'s, to the last bit. The mission hears of the result, as of its own goal's.
    """

    ticks: ClassVar[int] = 0
    observes: ClassVar[tuple[str, ...]] = ("odom", "amcl_pose")
    rewards: ClassVar[Mapping[str, float]] = {"goals": 1.0, "checks": 10.0, "time": 0.01}

    def __init__(self, episode: Episode, config: Any) -> None:
        super().__init__(episode, config)
        (x0, y0), (x1, y1) = episode.ground
        low, high = np.array([x0, y0, -math.pi]), np.array([x1, y1, math.pi])
        self.action_space = spaces.Box(low, high, dtype=np.float64)

    def act(self, action: Values) -> None:
        """Send the goal that waits."""
        last = self.episode.task.last
        assert last is not None
        last.send(Pose2(*action.tolist()), self.episode.stack.frames.map)
