"""A costmap as the messages of Nav2."""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import Costmap as CostmapMessage
from twin.bridge.msgs import (
    CostmapMetaData,
    CostmapUpdate,
    Header,
    OccupancyGrid,
    OccupancyGridUpdate,
    Point32,
    Polygon,
    PolygonStamped,
    Vector3,
    VoxelGrid,
    header,
    stamp,
)
from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.costmaps.costmap_config import VoxelConfig
from twin.navigation.costmaps.voxel_layer import Columns
from twin.navigation.costmaps.window import Window
from twin.nodes.navigation.mapping.map_server import grid_msg

_OCCUPANCY = (1 + (97 * (np.arange(256) - 1)) // 251).astype(np.int8)
"""nav2_costmap_2d's table from costs to the values of an OccupancyGrid."""
_OCCUPANCY[[FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION]] = 0, 99, 100, -1


def occupancy_grid(grid: Costmap, frame: str, time_ns: int) -> OccupancyGrid:
    """Return a costmap as `costmap` shows it: 0 free ... 98, 99 inscribed, 100 lethal, -1 unknown."""
    return grid_msg(_OCCUPANCY.take(grid.costs), grid.resolution, Pose2(*grid.origin, 0.0), frame, time_ns)


def costmap_msg(grid: Costmap, frame: str, time_ns: int) -> Any:
    """Return a costmap as `costmap_raw` shows it, with its own costs."""
    height, width = grid.costs.shape
    metadata = CostmapMetaData(
        map_load_time=stamp(0),
        update_time=stamp(time_ns),
        layer="master",
        resolution=float(grid.resolution),
        size_x=width,
        size_y=height,
        origin=pose_from_pose2(Pose2(*grid.origin, 0.0)),
    )
    return CostmapMessage(header=header(time_ns, frame), metadata=metadata, data=grid.costs.flatten())


def occupancy_grid_update(grid: Costmap, window: Window, frame: str, time_ns: int) -> Any:
    """Return the cells of a window as `costmap_updates` shows them."""
    cells = _OCCUPANCY.take(grid.costs[window.slices])
    height, width = cells.shape
    return OccupancyGridUpdate(
        header=header(time_ns, frame),
        x=window.x0,
        y=window.y0,
        width=width,
        height=height,
        data=cells.ravel(),
    )


def costmap_update(grid: Costmap, window: Window, frame: str, time_ns: int) -> Any:
    """Return the cells of a window as `costmap_raw_updates` shows them."""
    cells = grid.costs[window.slices]
    size_y, size_x = cells.shape
    return CostmapUpdate(
        header=header(time_ns, frame),
        x=window.x0,
        y=window.y0,
        size_x=size_x,
        size_y=size_y,
        data=cells.flatten(),
    )


def polygon_msg(corners: Array, frame: str, time_ns: int) -> PolygonStamped:
    """Return corners, shape (n, 2) [m], as a polygon in a frame."""
    points = [Point32(x, y, 0.0) for x, y in corners.tolist()]
    return PolygonStamped(header=header(time_ns, frame), polygon=Polygon(points=points))


def voxel_grid(grid: Costmap, columns: Columns, levels: VoxelConfig, placed: Header) -> VoxelGrid:
    """Return the columns of a costmap's voxel layer, shape (height, width), as `voxel_grid` shows them."""
    height, width = columns.shape
    return VoxelGrid(
        header=placed,
        data=columns.reshape(-1).copy(),
        origin=Point32(x=grid.origin[0], y=grid.origin[1], z=levels.origin_z),
        resolutions=Vector3(x=grid.resolution, y=grid.resolution, z=levels.z_resolution),
        size_x=width,
        size_y=height,
        size_z=levels.z_voxels,
    )
