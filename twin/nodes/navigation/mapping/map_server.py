"""`/map_server` and `/map_saver`, as in Nav2.

The one serves an occupancy map on `map` (latched) and by a service, and loads others. The other writes a
topic's map to files when it is asked to.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import MapMetaData, OccupancyGrid, header, new, stamp
from twin.bridge.node.tasks import Steps
from twin.bridge.node.timers import Beat
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.services import Respond
from twin.bridge.srvs import GetMap, LoadMap, SaveMap
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.maps.map_image import load_image
from twin.navigation.maps.map_saver import SaveParameters, save_map
from twin.navigation.maps.map_yaml import MODES, read_metadata
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.node_parameters import declare_config
from twin.parameters import DurationNs, Fraction, Interval


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


@dataclass(frozen=True, kw_only=True)
class MapSaverConfig:
    """Parameters of nav2_map_server's MapSaver."""

    save_map_timeout_ns: Annotated[DurationNs, Interval(ge=0.0, le=1e6)] = 2_000_000_000
    """How long a map is waited for."""
    free_thresh_default: Annotated[float, Fraction] = 0.25
    """Cells up to this share are free, for requests that say 0."""
    occupied_thresh_default: Annotated[float, Fraction] = 0.65
    """Cells from this share on are occupied, for requests that say 0."""
    map_subscribe_transient_local: bool = True
    """Whether a map that was published before is taken."""

    def __post_init__(self) -> None:
        if self.free_thresh_default >= self.occupied_thresh_default:
            raise ValueError(
                f"free_thresh_default is {self.free_thresh_default:g}, not less than "
                f"occupied_thresh_default, {self.occupied_thresh_default:g}"
            )


class MapSaverNode:
    """Offers `map_saver/save_map`."""

    def __init__(self, bus: Bus, config: MapSaverConfig | None = None, *, namespace: str = "") -> None:
        self.node = bus.create_node("map_saver", namespace)
        self.config = config or MapSaverConfig()
        declare_config(self.node, self.config, self._reconfigure)
        self.node.create_deferred_service(SaveMap, "map_saver/save_map", self._on_save)

    def _reconfigure(self, config: MapSaverConfig) -> None:
        self.config = config

    def _on_save(self, request: Any, respond: Respond) -> None:
        self.node.create_task(self._save(request, respond))

    def _save(self, request: Any, respond: Respond) -> Steps:
        """Wait for a map, write it, answer whether that went well; the log says what did not."""
        topic = request.map_topic or "map"
        message = yield from self._first(topic)
        try:
            if message is None:
                raise MapError(f"no map came on {topic} in {self.config.save_map_timeout_ns * 1e-9:g} s")
            path = self._path(request.map_url)
            save_map(occupancy_map(message), path, self._parameters(request))
        except MapError as error:
            self.node.get_logger().error(f"map not saved: {error}")
            respond(new(SaveMap.Response, result=False))
            return
        self.node.get_logger().info(f"map saved to {path}")
        respond(new(SaveMap.Response, result=True))

    def _first(self, topic: str) -> Generator[int, None, OccupancyGrid | None]:
        got: list[OccupancyGrid] = []
        qos = LATCHED if self.config.map_subscribe_transient_local else QoS(depth=1)
        subscription = self.node.create_subscription(OccupancyGrid, topic, got.append, qos)
        wait = Beat(self.node.get_clock())
        wait.put_off(self.config.save_map_timeout_ns)
        while not got and wait.late_ns < 0:
            yield wait.due_ns
        self.node.destroy_subscription(subscription)
        return got[0] if got else None

    def _path(self, map_url: str) -> Path:
        """Return the YAML file that a request names, with or without its ending."""
        path = Path(map_url or f"map_{self.node.now_ns // 1_000_000_000}").expanduser()
        return path if path.suffix == ".yaml" else path.with_name(path.name + ".yaml")

    def _parameters(self, request: Any) -> SaveParameters:
        mode = request.map_mode
        if mode not in MODES:
            if mode:
                self.node.get_logger().warn(f"map mode '{mode}' is unknown: the map is saved as trinary")
            mode = "trinary"
        return SaveParameters(
            mode=mode,
            image_format=request.image_format,
            # In single precision 0.65 is not 0.65.
            free_thresh=round(float(request.free_thresh), 6) or self.config.free_thresh_default,
            occupied_thresh=round(float(request.occupied_thresh), 6) or self.config.occupied_thresh_default,
        )
