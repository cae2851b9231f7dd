"""`/map_server`: serves an occupancy map on `map` (latched) and by a service, loads others; as in Nav2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import MapMetaData, OccupancyGrid, header, new, stamp
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import GetMap, LoadMap
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.maps.map_image import load_image
from twin.navigation.maps.map_yaml import read_metadata
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
    """Publishes the map once, and again when another one is loaded; late subscribers get it too."""

    def __init__(
        self,
        bus: Bus,
        grid: OccupancyMap,
        *,
        frame: str = "map",
        name: str = "map_server",
        topic: str = "map",
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node(name, namespace)
        self._frame = frame
        self._publisher = self.node.create_publisher(OccupancyGrid, topic, LATCHED)
        self.node.create_service(GetMap, f"{name}/map", lambda _: GetMap.Response(map=self.message))
        self.node.create_service(LoadMap, f"{name}/load_map", self._on_load)
        self._serve(grid)

    def _serve(self, grid: OccupancyMap) -> None:
        self.message = grid_msg(grid.data, grid.resolution, grid.origin, self._frame, self.node.now_ns)
        self._publisher.publish(self.message)

    def _on_load(self, request: Any) -> Any:
        """Serve the map of a YAML file; where it cannot be read, the old one stays."""
        response = LoadMap.Response
        if not request.map_url:
            return new(response, result=response.RESULT_MAP_DOES_NOT_EXIST)
        path = Path(request.map_url)
        try:
            metadata = read_metadata(path.expanduser())
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return new(response, result=response.RESULT_INVALID_MAP_METADATA)
        try:
            self._serve(load_image(metadata))
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return new(response, result=response.RESULT_INVALID_MAP_DATA)
        return new(response, result=response.RESULT_SUCCESS, map=self.message)
