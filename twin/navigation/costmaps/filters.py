"""Nav2's costmap filters: keep-out zones and speed limits drawn as masks over the map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from twin.geometry import Pose2
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    triple,
)
from twin.navigation.costmaps.costmap_config import KeepoutConfig
from twin.navigation.costmaps.kernels import Cells, Triple
from twin.navigation.maps.occupancy_map import UNKNOWN, OccupancyMap

KEEPOUT_FILTER, SPEED_FILTER_PERCENT, SPEED_FILTER_ABSOLUTE = 0, 1, 2
"""Types of nav2_msgs/msg/CostmapFilterInfo."""
NO_SPEED_LIMIT = 0.0
"""Of nav2_msgs/msg/SpeedLimit."""

_SAME_FRAME = Pose2(0.0, 0.0, 0.0)


@dataclass(kw_only=True)
class KeepoutFilter:
    """A mask as costs: 100 is lethal, 0 free, between them linear, -1 says nothing."""

    mask: OccupancyMap
    config: KeepoutConfig = field(default_factory=KeepoutConfig)

    def __post_init__(self) -> None:
        levels = np.arange(101) * (LETHAL_OBSTACLE / 100.0)
        table = np.full(256, NO_INFORMATION, dtype=np.uint8)
        table[:101] = np.floor(levels + 0.5)
        self._costs: Cells = table[self.mask.data.view(np.uint8)]

    def costs(
        self,
        shape: tuple[int, ...],
        frame: Triple,
        robot: Pose2 | None = None,
        T_mask_costmap: Pose2 = _SAME_FRAME,
    ) -> Cells:
        """Return the mask as a layer of a costmap.

        Args:
            shape: Height and width of the costmap.
            frame: Origin x, y and resolution of the costmap [m].
            robot: Pose in the costmap's frame, for `override_lethal_cost`.
            T_mask_costmap: Pose of the costmap's frame in the mask's.
        """
        out = np.full(shape, NO_INFORMATION, dtype=np.uint8)
        T_grid = self.mask.origin.inverse() @ T_mask_costmap
        _sample(out, self._costs, triple(T_grid), self.mask.resolution, frame)
        if self.config.override_lethal_cost and robot is not None:
            here = T_mask_costmap.apply([robot.x, robot.y])
            column, row = self.mask.world_to_cell(here)
            collision = (INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE)
            if bool(self.mask.contains(here)) and self._costs[row, column] in collision:
                out[(out != NO_INFORMATION) & (out > 0)] = self.config.lethal_override_cost
        return out


@dataclass(frozen=True)
class SpeedLimit:
    """What nav2_msgs/msg/SpeedLimit says."""

    percentage: bool
    """Whether the limit is per cent of the greatest speed, not m/s."""
    speed_limit: float
    """0 is no limit."""


@dataclass(frozen=True, kw_only=True)
class SpeedFilter:
    """A mask of speed limits: base + multiplier times its value; 0 is no limit, -1 says nothing."""

    mask: OccupancyMap
    type: int = SPEED_FILTER_PERCENT
    base: float = 0.0
    multiplier: float = 1.0

    def limit_at(self, x: float, y: float) -> SpeedLimit | None:
        """Return the limit at a point of the mask's frame [m]; None where the mask says nothing.

        A limit out of bounds is none. Source: nav2_costmap_2d, SpeedFilter::getSpeedLimitAtPose.
        """
        if not bool(self.mask.contains([x, y])):
            return None
        value = int(self.mask.value_at([x, y]))
        if value == UNKNOWN:
            return None
        percentage = self.type == SPEED_FILTER_PERCENT
        limit = value * self.multiplier + self.base if value else NO_SPEED_LIMIT
        if not math.isfinite(limit) or limit < 0.0 or (percentage and limit > 100.0):
            limit = NO_SPEED_LIMIT
        return SpeedLimit(percentage, limit)


@jit
def _sample(out: Cells, mask: Cells, pose: Triple, mask_resolution: float, frame: Triple) -> None:
    """Write the mask's value at each cell's centre; `pose` is the grid's frame in the mask's corner."""
    (x, y, yaw), (origin_x, origin_y, resolution) = pose, frame
    c, s = math.cos(yaw), math.sin(yaw)
    height, width = mask.shape
    for v in range(out.shape[0]):
        py = origin_y + (v + 0.5) * resolution
        for u in range(out.shape[1]):
            px = origin_x + (u + 0.5) * resolution
            i = math.floor((x + c * px - s * py) / mask_resolution)
            j = math.floor((y + s * px + c * py) / mask_resolution)
            if 0 <= i < width and 0 <= j < height:
                out[v, u] = mask[int(j), int(i)]
