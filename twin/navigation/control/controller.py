"""What every controller offers to the controller server (nav2_core::Controller)."""

from __future__ import annotations

from typing import Protocol

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import Costmap


class Controller(Protocol):
    """Follows one path at a time; a new path array starts it over."""

    carrot: tuple[float, float] | None
    """The point that the last command steered for, in the path's frame [m]; None if it steers for none."""

    def reset(self) -> None:
        """Forget the path, and what was learnt on it."""

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than `limit` [m/s]; None lifts the limit (nav2's SpeedLimit)."""

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
