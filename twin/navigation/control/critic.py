"""What a critic of MPPI or DWB is that comes from a user; those that ship are parts of compiled loops."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from twin.geometry import Array, Pose2
from twin.navigation.configured import Configured
from twin.navigation.costmaps.costmap import Costmap


@dataclass(frozen=True, kw_only=True)
class Trajectories:
    """The ways that a controller compares; all in the costmap's frame [m, rad]."""

    poses: Array
    """Shape (n, steps, 3): x, y, yaw after each step; of DWB the last one alone, shape (n, 1, 3)."""
    commands: Array
    """Shape (n, steps, 2): v [m/s], w [rad/s] as they are asked for, before the drive's limits."""
    start: Pose2
    """Where all of them begin."""
    velocity: tuple[float, float]
    """The present v [m/s], w [rad/s]."""
    path: Array
    """Shape (m, 3): the part of the path that is followed now, the nearest pose first."""
    costmap: Costmap
    """Around the robot."""


class Critic(Configured, ABC):
    """Tells what is bad about trajectories."""

    @abstractmethod
    def score(self, trajectories: Trajectories) -> Array:
        """Return what each trajectory costs, shape (n,), finite; it is added to what other critics say.

        In the end collisions cost 1 000 000 with MPPI, and are out of question with DWB.
        """
