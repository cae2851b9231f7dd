"""What every controller offers to the controller server (nav2_core::Controller)."""

from __future__ import annotations

from typing import Any, Protocol

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import Costmap


class Controller(Protocol):
    """Follows one path at a time; a new path array starts it over."""

    config: Any
    """Its parameters, frozen; see `configure`."""
    carrot: tuple[float, float] | None
    """The point that the last command steered for, in the path's frame [m]; None if it steers for none."""

    @property
    def trajectory(self) -> Array | None:
        """Where the last command begins to lead, in the path's frame: shape (n, 3); None if it plans none."""

    @property
    def candidates(self) -> Array | None:
        """Some of the ways it chose from, in the path's frame, shape (n, m, 2) [m]; None: there were none."""

    @property
    def max_speed(self) -> float:
        """The speed that percentages of a speed limit are of [m/s]."""

    @property
    def reverses(self) -> bool:
        """Whether it drives paths backwards where their headings say so."""

    def configure(self, config: Any) -> None:
        """Go on with other parameters of the same kind; lifts the speed limit."""

    def reset(self) -> None:
        """Forget the path, and what was learnt on it."""

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than `limit` [m/s]; None lifts the limit (nav2's SpeedLimit)."""

    def set_goal_tolerance(self, xy: float) -> None:
        """Tell how near the goal counts as there [m]: what only turns at the goal does it from there on."""

    def cancel(self) -> bool:
        """Come to rest; return whether the robot may be stopped now (nav2_core::Controller::cancel)."""

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
        """Return the command (v [m/s], w [rad/s]).

        Args:
            pose: Of the base, in the path's frame.
            velocity: The present (v, w).
            path: Shape (n, 3): x, y, yaw.
            costmap: Around the robot; None: nothing is known of obstacles.
            dt: Control period [s].
            costmap_pose: Of the base in the costmap's frame; None where that is the path's frame too.

        Raises:
            InvalidPath: the path is empty, not finite or not of shape (n, 3).
            NoValidControl: no command is free of collisions.
        """
