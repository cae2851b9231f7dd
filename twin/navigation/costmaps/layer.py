"""What a layer of a costmap is (nav2_costmap_2d::Layer)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from twin.geometry import Pose2
from twin.navigation.configured import Configured
from twin.navigation.costmaps.costmap import NO_INFORMATION, Costmap
from twin.navigation.costmaps.kernels import Cells
from twin.navigation.costmaps.window import NOTHING, Window, cut_out, everything, raised


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


class CellLayer(Layer):
    """Keeps a value for each cell; raises costs to what the values say."""

    def __init__(self, cells: Cells) -> None:
        super().__init__()
        self.cells = cells

    def costs(self, window: Window) -> Cells:
        """Return the costs of a window's cells; 255 says nothing."""
        return self.cells[window.slices]

    def update_costs(self, grid: Costmap, window: Window) -> None:
        """Raise the costs."""
        at = window.slices
        grid.costs[at] = raised(grid.costs[at], self.costs(window))


class SensedLayer(CellLayer):
    """Cells that remember what sensors have seen."""

    unseen: ClassVar[int] = NO_INFORMATION
    """The value of a cell that nobody has seen."""

    def __init__(self, shape: tuple[int, int]) -> None:
        super().__init__(np.full(shape, self.unseen, dtype=np.uint8))

    def forget(self, window: Window, *, outside: bool = False) -> Window:
        """Forget what was seen in a window, or outside of it; return where that may matter."""
        if not outside:
            self.cells[window.slices] = self.unseen
            return window
        kept = self.cells[window.slices].copy()
        self.cells.fill(self.unseen)
        self.cells[window.slices] = kept
        return everything(self.cells.shape)

    def move(self, dx: int, dy: int) -> None:
        """Follow a grid that rolls by (dx, dy) cells."""
        self.adopt(self, dx, dy)

    def adopt(self, old: SensedLayer, dx: int, dy: int) -> None:
        """Take what was seen on another grid, from whose corner this one's is (dx, dy) cells away."""
        self.cells = cut_out(old.cells, self.cells.shape, dx, dy, self.unseen)
