"""The options by which every ros2-like command finds the graph it talks to."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.bridge.wire import Wire
from twin.cli.option_groups import takes
from twin.cli.ros.endings import quiet_pipe
from twin.cli.ros.own_types import Interfaces, add_interfaces

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.graph import Graph
    from twin.bridge.live import LiveBus

PANEL = "Joining the graph"
_AT_ONCE_S = 3.0
PATIENCE_S = 60.0
"""How long a command that waits for a server waits for somebody to listen [s]: runs take a while to start."""


def whole_graph(bus: Bus) -> Graph:
    """Return who is there, and say what is not known of it."""
    from twin.bridge.graph import Graph

    graph = Graph.whole(bus)
    if graph.lacks:
        typer.echo(f"WARNING: what is shown may be incomplete: {graph.lacks}", err=True)
    return graph


@dataclass(frozen=True, kw_only=True)
class Joining:
    """Which graph a command joins, and how."""

    connect: tuple[str, ...] | None
    config: Path | None
    domain_id: int | None
    use_sim_time: bool
    wire: Wire

    @contextmanager
    def open(self, patience_s: float = _AT_ONCE_S) -> Iterator[LiveBus]:
        """Join; raises BridgeError if nobody is there in this time [s], and says what it waits for."""
        from twin.bridge import live
        from twin.errors import NobodyAnswersError

        def join(timeout_s: float) -> AbstractContextManager[LiveBus]:
            return live.join(
                self.connect,
                config=self.config,
                domain_id=self.domain_id,
                use_sim_time=self.use_sim_time,
                wire=self.wire,
                timeout_s=timeout_s,
            )

        with ExitStack() as ending:
            try:
                process = ending.enter_context(join(_AT_ONCE_S))
            except NobodyAnswersError as fault:
                if patience_s <= _AT_ONCE_S:
                    raise
                typer.echo(f"waiting: {fault}", err=True)
                process = ending.enter_context(join(patience_s - _AT_ONCE_S))
            yield process

    def graph(self) -> Graph:
        """Return who is in the graph, once it is whole; raises BridgeError if nobody is there."""
        with self.open() as process:
            return whole_graph(process.bus)


def _options(
    connect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Where a run or a router listens.",
            rich_help_panel=PANEL,
            show_default="TWIN_CONNECT, else tcp/127.0.0.1:7447",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            envvar="ZENOH_SESSION_CONFIG_URI",
            exists=True,
            dir_okay=False,
            help="Zenoh configuration.",
            rich_help_panel=PANEL,
        ),
    ] = None,
    domain: Annotated[
        int | None,
        typer.Option(envvar="ROS_DOMAIN_ID", min=0, max=232, help="ROS domain.", rich_help_panel=PANEL),
    ] = None,
    use_sim_time: Annotated[
        bool, typer.Option("--use-sim-time", "-s", help="Take the time from /clock.", rich_help_panel=PANEL)
    ] = False,
    wire: Annotated[
        Wire, typer.Option(help="How names are spelled; all are heard.", rich_help_panel=PANEL)
    ] = "rmw_zenoh",
    interfaces: Interfaces = None,
) -> Joining:
    add_interfaces(interfaces)
    return Joining(
        connect=tuple(connect) if connect else None,
        config=config,
        domain_id=domain,
        use_sim_time=use_sim_time,
        wire=wire,
    )


def joins(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command whose last parameter is `joining: Joining` the options of which that is made."""
    joined = takes("joining", _options)(command)

    @functools.wraps(joined)
    def wrapper(**given: Any) -> None:
        with quiet_pipe():
            joined(**given)

    return wrapper
