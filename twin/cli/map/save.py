"""`twin map save`: the map of a graph that is running, as nav2's map_saver_cli."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.map.map_files import Format, Mode, told, yaml_path
from twin.cli.ros.graph_names import absolute
from twin.cli.ros.joining import Joining, joins, tool_node

if TYPE_CHECKING:
    from twin.bridge.live import LiveBus


@joins
def save(
    topic: Annotated[str, typer.Option("-t", "--topic", help="Where the map is published.")] = "map",
    name: Annotated[
        Path | None,
        typer.Option("-f", "--file", metavar="FILE", help="Path without ending.", show_default="map_<time>"),
    ] = None,
    mode: Mode = "trinary",
    image_format: Format = "",
    occupied: Annotated[float, typer.Option("--occ", help="Cells from this share on are occupied.")] = 0.65,
    free: Annotated[float, typer.Option("--free", help="Cells up to this share are free.")] = 0.25,
    transient_local: Annotated[
        bool,
        typer.Option(
            "--map_subscribe_transient_local/--no-map_subscribe_transient_local",
            help="Take a map that was published before, too.",
        ),
    ] = True,
    timeout: Annotated[
        float, typer.Option("--save_map_timeout", metavar="S", min=0.0, help="Give up after so long.")
    ] = 5.0,
    *,
    joining: Joining,
) -> None:
    """Save the map of a live graph as YAML and image; as `ros2 run nav2_map_server map_saver_cli`."""
    from twin.cli.run.folders import map_name
    from twin.navigation.maps.map_saver import SaveParameters, save_map
    from twin.nodes.navigation.mapping.map_server import occupancy_map

    parameters = SaveParameters(
        mode=mode,  # type: ignore[arg-type]
        image_format=image_format,
        occupied_thresh=occupied,
        free_thresh=free,
    )
    path = yaml_path(name or map_name())
    with joining.open() as process:
        message = _first_map(process, absolute(topic), transient_local, timeout)
    occupancy = occupancy_map(message)
    typer.echo(told(occupancy, path, save_map(occupancy, path, parameters)))


def _first_map(process: LiveBus, topic: str, transient_local: bool, timeout_s: float) -> Any:
    from twin.bridge.msgs import OccupancyGrid
    from twin.bridge.qos import LATCHED, QoS
    from twin.errors import MapError

    got: list[Any] = []
    node = tool_node(process.bus, "map_saver")
    node.create_subscription(OccupancyGrid, topic, got.append, LATCHED if transient_local else QoS(depth=1))
    if not process.spin(lambda: bool(got), timeout_s):
        raise MapError(f"no map came on {topic} in {timeout_s:g} s; is a map server running?")
    return got[0]
