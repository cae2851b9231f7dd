"""What every controller is to the controller server (nav2_core::Controller)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import Costmap

_STILL_THERE = 0.25
"""A goal once reached is so no more when the robot is farther off than the tolerance by so much [m]."""
_NO_COSTMAP = Costmap(costs=np.zeros((1, 1), dtype=np.uint8), resolution=1.0)


@dataclass(frozen=True, kw_only=True)
class Situation:
    """What one command is made from."""

    pose: Pose2
    """Of the base, in the path's frame: x, y [m], yaw [rad]."""
    velocity: tuple[float, float]
    """The present (v [m/s], w [rad/s])."""
    costmap: Costmap | None
    """Around the robot; None: nothing is known of obstacles."""
    at: Pose2
    """Of the base, in the costmap's frame."""
    dt: float
    """Control period [s]."""

    @property
    def grid(self) -> Costmap:
        """The costmap, or one that is free everywhere."""
        return self.costmap or _NO_COSTMAP

    @property
    def at_grid(self) -> Pose2:
        """The base from the costmap's lower left corner."""
        origin = self.grid.origin
        return Pose2(self.at.x - origin[0], self.at.y - origin[1], self.at.yaw)


class Controller(ABC):
    """Follows one path at a time.

    The path is in `path`, its parameters, an object of its `Config`, are in `config`. What depends on them
    alone is made in `_build`, what on the path in `set_plan`.
    """

    Config: ClassVar[type | None] = None
    """Frozen dataclass of its parameters; None: it has none."""
    config: Any
    """Its parameters; see `configure`."""
    path: Array | None = None
    """What is followed: shape (n, 3), n >= 1: x, y [m], yaw [rad], finite, in the map's frame."""
    carrot: tuple[float, float] | None = None
    """The point that the last command steered for, in the path's frame [m]; None if it steers for none."""

    def __init__(self, *, config: Any, footprint: Array | None = None) -> None:
        """Take a footprint of shape (n, 2) [m]; without one the centre is checked for inscribed cost."""
        self.footprint = np.array(np.zeros((1, 2)) if footprint is None else footprint, np.float64, order="C")
        self._tolerance = 0.25
        self._take(config)

    @property
    def trajectory(self) -> Array | None:
        """Where the last command begins to lead, in the path's frame: shape (n, 3); None if it plans none."""
        return None

    @property
    def candidates(self) -> Array | None:
        """Some of the ways it chose from, in the path's frame, shape (n, m, 2) [m]; None: there were none."""
        return None

    @property
    @abstractmethod
    def max_speed(self) -> float:
        """The speed that percentages of a speed limit are of [m/s]."""

    @property
    def reverses(self) -> bool:
        """Whether it drives paths backwards where their headings say so."""
        return False

    def configure(self, config: Any) -> None:
        """Go on with other parameters of the same kind, and the same path; lifts the speed limit."""
        path = self.path
        self._take(config)
        if path is not None:
            self.set_plan(path)

    def _take(self, config: Any) -> None:
        self.config = config
        self._limit: float | None = None
        self._build()
        self.reset()

    def _build(self) -> None:
        """Make what depends on the parameters."""
        return

    def set_plan(self, path: Array) -> None:
        """Follow another path, shape (n, 3), from now on (nav2_core::Controller::newPathReceived).

        Raises:
            InvalidPath: the path is empty, not finite or not of shape (n, 3).
        """
        self.path = path

    def reset(self) -> None:
        """Forget the path, and what was learnt on it."""
        self.path = self.carrot = None

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than `limit` [m/s]; None lifts the limit (nav2's SpeedLimit)."""
        self._limit = limit

    @property
    def speed(self) -> float:
        """`max_speed`, or the limit that is below it [m/s]."""
        return self.max_speed if self._limit is None else min(self._limit, self.max_speed)

    def set_goal_tolerance(self, xy: float) -> None:
        """Tell how near the goal counts as there [m]: what only turns at the goal does it from there on."""
        self._tolerance = xy

    def _is_there(self, was_there: bool, off: float, *, at_end: bool) -> bool:
        """Return whether the robot is at the goal, so that it turns there; it may be carried off again.

        Args:
            was_there: The last answer.
            off: Distance to the goal [m].
            at_end: Whether the goal is what is driven to now: a path may pass by its own end.
        """
        if was_there:
            return off <= self._tolerance + _STILL_THERE
        return at_end and off <= self._tolerance

    def cancel(self) -> bool:
        """Come to rest; return whether the robot may be stopped now (nav2_core::Controller::cancel)."""
        return True

    def compute_velocity(
        self,
        pose: Pose2,
        velocity: tuple[float, float],
        path: Array,
        costmap: Costmap | None,
        dt: float,
        *,
        costmap_pose: Pose2 | None = None,
    ) -> tuple[float, float]:
        """Return the command to follow `path`, a new one or not; the others are those of `Situation`.

        Without `costmap_pose` the costmap's frame is the path's.
        """
        if path is not self.path:
            self.set_plan(path)
        at = pose if costmap_pose is None else costmap_pose
        return self.compute_velocity_commands(
            Situation(pose=pose, velocity=velocity, costmap=costmap, at=at, dt=dt)
        )

    @abstractmethod
    def compute_velocity_commands(self, now: Situation) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]), finite; asked once per control period, after `set_plan`.

        Raises:
            NoValidControl: no command is free of collisions.
        """
