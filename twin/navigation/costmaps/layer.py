"""What a layer of a costmap is (nav2_costmap_2d::Layer)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from twin.geometry import Pose2
from twin.navigation.configured import Configured
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.window import NOTHING, Window


class Layer(Configured, ABC):
    """Adds costs to the master grid, after the layers that are listed before it."""

    is_known: ClassVar[bool] = False
    """Whether what it marks is known beforehand, as a map is, and not seen by a sensor."""

    def update_bounds(self, grid: Costmap, robot: Pose2 | None, now_ns: int) -> Window:
        """Return which cells change; asked at every update.

        Args:
            grid: The costmap as it is; a rolling one has moved with the robot.
            robot: Pose of the base in the costmap's frame; None while it is not known.
            now_ns: The time.
        """
        return NOTHING

    @abstractmethod
    def update_costs(self, grid: Costmap, window: Window) -> None:
        """Write its costs into `grid.costs[window.slices]`, where the layers before it have theirs.

        What it makes 254 before the inflation layer is inflated. A window is written again whenever anything
        in it changes.

        Args:
            grid: Costs of shape (height, width), uint8; `world_to_cell` and `cell_to_world` of the frame.
            window: Which cells may be written.
        """

    def reset(self) -> None:
        """Forget what was seen, as services that clear costmaps ask."""
        return
