"""`/map_saver`: writes a topic's map to files when it is asked to, as in Nav2."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from twin.bridge.bus import Bus
from twin.bridge.msgs import OccupancyGrid, new
from twin.bridge.node.tasks import Steps
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.services import Respond
from twin.bridge.srvs import SaveMap
from twin.errors import MapError
from twin.navigation.maps.map_saver import SaveParameters, save_map
from twin.navigation.maps.map_yaml import MODES
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.node_parameters import declare_config
from twin.parameters import DurationNs, Fraction, Interval


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
        end = self.node.now_ns + self.config.save_map_timeout_ns
        while not got and self.node.now_ns < end:
            yield end
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
