"""An agent that drives: a velocity in each step, in place of the navigator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.envs.scenario.agents.agent import Values, unit_box
from twin.envs.scenario.agents.navigating import NavigatingAgent
from twin.envs.scenario.episode import Episode
from twin.geometry import wrap_angle

_AGAIN_NS = 100_000_000
"""A velocity is said again so often while it holds: who hears none for a while stops the robot."""


class Drive(NavigatingAgent):
    """Sends velocities to `cmd_vel_teleop`, or to `cmd_vel` of a robot without a multiplexer.

    An action is (v, w) as parts of the drive's largest forward speed and turn rate, each from -1 to 1.
    Goals of the mission do not reach the navigator: the agent drives there, and the mission is told when
    the robot believes to be at the goal. Between goals, while the mission does something else, the agent
    is not asked.
    """

    @dataclass(frozen=True, kw_only=True)
    class Config:
        """What counts as there; None: what the robot's own goal checker says."""

        xy_goal_tolerance: float | None = None
        """[m]"""
        yaw_goal_tolerance: float | None = None
        """[rad]"""

    observes: ClassVar[tuple[str, ...]] = ("scan", "odom", "amcl_pose")
    rewards: ClassVar[Mapping[str, float]] = {
        "progress": 1.0,
        "goals": 10.0,
        "collision": 1.0,
        "checks": 10.0,
        "time": 0.1,
    }

    def __init__(self, episode: Episode, config: Config) -> None:
        super().__init__(episode, config)
        self.action_space = unit_box(2)
        has_mux = episode.stack.context.config.navigation is not None
        self._publisher = episode.node.create_publisher(Twist, "cmd_vel_teleop" if has_mux else "cmd_vel")
        self._xy = self._tolerance("xy_goal_tolerance", config.xy_goal_tolerance)
        self._yaw = self._tolerance("yaw_goal_tolerance", config.yaw_goal_tolerance)
        self._command = (0.0, 0.0)
        self._said_ns = 0

    def act(self, action: Values) -> None:
        """Say a velocity."""
        v, w = self.episode.speed
        self._say(v * float(action[0]), w * float(action[1]))

    def watch(self) -> None:
        """Say the velocity again, or stop at the goal and tell the mission."""
        last, ahead = self.episode.task.last, self._ahead()
        if last is None or not last.waits or ahead is None:
            return
        if math.hypot(ahead.x, ahead.y) <= self._xy and abs(wrap_angle(ahead.yaw)) <= self._yaw:
            self._say(0.0, 0.0)
            last.succeed()
        elif self.episode.node.now_ns >= self._said_ns + _AGAIN_NS:
            self._say(*self._command)

    def _say(self, linear: float, angular: float) -> None:
        self._command, self._said_ns = (linear, angular), self.episode.node.now_ns
        self._publisher.publish(twist_from_planar(linear, angular), frozen=True)

    def _tolerance(self, name: str, given: float | None) -> float:
        """Return a tolerance, from the parameters of the robot's controller server if none is given."""
        if given is not None:
            return given
        wanted = f"{self.episode.stack.context.namespace}/controller_server"
        found: list[Any] = []
        for node in self.episode.run.bus.nodes:
            if node.fully_qualified_name == wanted:
                checkers = node.get_parameter("goal_checker_plugins").value
                found += [node.get_parameter_or(f"{checker}.{name}").value for checker in checkers]
        return next((float(value) for value in found if value is not None), math.inf)
