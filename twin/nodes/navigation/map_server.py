"""`/map_server`: serves an occupancy map on `map` (latched) and by `map_server/map`, as in Nav2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import MapMetaData, OccupancyGrid, header, stamp
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import GetMap
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap


def grid_msg(
    data: NDArray[np.int8], resolution: float, origin: Pose2, frame: str, time_ns: int
) -> OccupancyGrid:
    """Return a grid, int8 of shape (height, width), as a message."""
    height, width = data.shape
    info = MapMetaData(
        map_load_time=stamp(time_ns),
        resolution=resolution,
        width=width,
        height=height,
        origin=pose_from_pose2(origin),
    )
    return OccupancyGrid(header=header(time_ns, frame), info=info, data=data.ravel())


def occupancy_map(message: OccupancyGrid) -> OccupancyMap:
    """Return a message as a map.

    Raises:
        MapError: The data does not have the size that the message says.
    """
    info = message.info
    if len(message.data) != info.width * info.height or not info.resolution > 0.0:
        raise MapError(
            f"a map of {info.width} x {info.height} cells of {info.resolution:g} m with {len(message.data)} "
            "values is none"
        )
    return OccupancyMap(
        data=message.data.reshape(info.height, info.width),
        resolution=float(info.resolution),
        origin=pose2_from_pose(info.origin),
    )


class MapServerNode:
    """Publishes the map once; late subscribers get it too."""

    def __init__(self, bus: Bus, grid: OccupancyMap, *, frame: str = "map", namespace: str = "") -> None:
        self.node = bus.create_node("map_server", namespace)
        self.message = grid_msg(grid.data, grid.resolution, grid.origin, frame, self.node.now_ns)
        self.node.create_service(GetMap, "map_server/map", lambda _: GetMap.Response(map=self.message))
        self.node.create_publisher(OccupancyGrid, "map", LATCHED).publish(self.message)
