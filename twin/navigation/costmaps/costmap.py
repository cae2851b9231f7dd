"""A grid of costs with Nav2's values, and what to ask of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.kernels import Cells, Triple, outline_cost, steps_to_collision

FREE_SPACE = 0
MAX_NON_OBSTACLE = 252
INSCRIBED_INFLATED_OBSTACLE = 253
LETHAL_OBSTACLE = 254
NO_INFORMATION = 255


@dataclass(frozen=True, kw_only=True)
class Costmap:
    """A grid of costs: 0 free ... 252, 253 inscribed, 254 lethal, 255 unknown."""

    costs: Cells
    """Shape (height, width); row 0 is the lowest y."""
    resolution: float
    """[m]"""
    origin: tuple[float, float] = (0.0, 0.0)
    """Lower-left corner of cell (0, 0) [m]."""
    inscribed_radius: float = 0.0
    """Of the footprint that the costs were inflated for [m]."""
    cost_scaling_factor: float = 10.0
    """Of the inflation [1/m]."""

    @property
    def frame(self) -> Triple:
        """Origin x, y and resolution [m], as floats: what compiled functions take."""
        return float(self.origin[0]), float(self.origin[1]), float(self.resolution)

    def world_to_cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell (column, row) of a point [m]; possibly outside."""
        return (
            math.floor((x - self.origin[0]) / self.resolution),
            math.floor((y - self.origin[1]) / self.resolution),
        )

    def cell_to_world(self, cells: ArrayLike) -> Array:
        """Return the centres [m] of cells (column, row); both of shape (..., 2)."""
        return (np.asarray(cells, dtype=np.float64) + 0.5) * self.resolution + self.origin

    def contains(self, x: float, y: float) -> bool:
        """Return whether a point [m] lies on the grid."""
        column, row = self.world_to_cell(x, y)
        return 0 <= row < self.costs.shape[0] and 0 <= column < self.costs.shape[1]

    def cost_at(self, x: float, y: float) -> int:
        """Return the cost at a point [m]; 255 (unknown) outside."""
        column, row = self.world_to_cell(x, y)
        height, width = self.costs.shape
        return self.costs.item(row, column) if 0 <= row < height and 0 <= column < width else NO_INFORMATION

    def cost_within(self, distance: float) -> int:
        """Return the cost of a cell so far [m] from the nearest lethal one, without an inflation radius."""
        cost = inflation_costs(
            distance,
            inscribed_radius=self.inscribed_radius,
            inflation_radius=math.inf,
            cost_scaling_factor=self.cost_scaling_factor,
        )
        return int(cost)


def triple(pose: Pose2) -> Triple:
    """Return a pose as compiled functions take it."""
    return float(pose.x), float(pose.y), float(pose.yaw)


def footprint_cost(costmap: Costmap, footprint: Array, pose: Pose2) -> int:
    """Return the highest cost under the outline of `footprint`, shape (n, 2), at `pose`; 254 off the map.

    Source: nav2_costmap_2d FootprintCollisionChecker. 254 is a collision; 255 touches unknown space.
    """
    corners = np.array(footprint, dtype=np.float64, order="C")
    return outline_cost(costmap.costs, corners, triple(pose), costmap.frame)


def collision_step(
    costmap: Costmap,
    footprint: Array,
    pose: Pose2,
    command: tuple[float, float],
    dt: float,
    max_steps: int,
    max_distance: float = math.inf,
) -> int:
    """Return after how many steps a command drives the outline into something; -1 if never.

    Args:
        costmap: The grid.
        footprint: As `outline_cost` takes it: shape (n, 2) [m], C-contiguous; with a single corner the
            inscribed cost of the centre is a collision.
        pose: Of the base, in the costmap's frame.
        command: v [m/s], w [rad/s], kept up.
        dt: Of a step [s].
        max_steps: Where the projection ends at the latest.
        max_distance: From the pose [m]; it ends there, too.
    """
    at, velocity = triple(pose), (float(command[0]), float(command[1]))
    return steps_to_collision(
        costmap.costs, footprint, at, velocity, dt, max_steps, max_distance, costmap.frame
    )


def inflation_costs(
    distance: ArrayLike, *, inscribed_radius: float, inflation_radius: float, cost_scaling_factor: float
) -> Cells:
    """Return the cost at distances [m] from the nearest lethal cell: nav2's InflationLayer::computeCost."""
    distance = np.asarray(distance, dtype=np.float64)
    decay = np.exp(-cost_scaling_factor * (distance - inscribed_radius))
    cost = np.floor((INSCRIBED_INFLATED_OBSTACLE - 1) * np.minimum(decay, 1.0))
    cost = np.where(distance <= inscribed_radius, INSCRIBED_INFLATED_OBSTACLE, cost)
    cost = np.where(distance > inflation_radius, FREE_SPACE, cost)
    return np.where(distance == 0.0, LETHAL_OBSTACLE, cost).astype(np.uint8)
