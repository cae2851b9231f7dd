"""The options by which every ros2-like command finds the graph it talks to."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.bridge.wire import Wire
from twin.cli.option_groups import example, takes
from twin.cli.ros.endings import quiet_pipe

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.graph import Graph
    from twin.bridge.live import LiveBus
    from twin.bridge.node import Node

_AT_ONCE_S = 3.0
PATIENCE_S = 60.0
"""How long a command that waits for a server waits for somebody to listen [s]: runs take a while to start."""


def tool_node(bus: Bus, name: str, *, shown_as: str | None = None) -> Node:
    """Return a node without parameters and log: `_ros2cli_<name>`, which lists leave out, or as asked for."""
    from twin.bridge.node.options import BARE

    return bus.create_node(shown_as or f"_ros2cli_{name}", options=BARE)


def whole_graph(bus: Bus) -> Graph:
    """Return who is there, and say what is not known of it."""
    from twin.bridge.graph import Graph

    graph = Graph.whole(bus)
    if graph.lacks:
        typer.echo(f"WARNING: what is shown may be incomplete: {graph.lacks}", err=True)
    return graph


Factory = Annotated[
    str,
    typer.Argument(
        metavar="FILE.py:FACTORY",
        help="A function that takes the bus and returns a node, or a list of them.",
        show_default=False,
    ),
]
Interfaces = Annotated[
    list[Path] | None,
    typer.Option(
        "--interfaces",
        metavar="DIR",
        envvar="TWIN_INTERFACES",
        help="A package, workspace or share folder with .msg, .srv, .action files; repeatable.",
        show_default=False,
    ),
]


def add_interfaces(folders: Sequence[Path] | None) -> None:
    """Make the interfaces of folders known.

    Raises:
        BridgeError: no such folder, or all faults in its files.
    """
    if folders:
        from twin.bridge import types

        types.add_folders(folders)


_option = partial(typer.Option, rich_help_panel="Joining the graph")


@dataclass(frozen=True, kw_only=True)
class Joining:
    """Which graph a command joins, and how."""

    connect: Annotated[
        list[str] | None,
        _option(
            metavar="ENDPOINT",
            help="Where a run or a router listens.",
            show_default="TWIN_CONNECT, else tcp/127.0.0.1:7447",
        ),
    ] = None
    config: Annotated[
        Path | None,
        _option(
            metavar="FILE",
            envvar="ZENOH_SESSION_CONFIG_URI",
            exists=True,
            dir_okay=False,
            help="Zenoh configuration.",
        ),
    ] = None
    domain: Annotated[int | None, _option(envvar="ROS_DOMAIN_ID", min=0, max=232, help="ROS domain.")] = None
    use_sim_time: Annotated[bool, _option("--use-sim-time", "-s", help="Take the time from /clock.")] = False
    wire: Annotated[Wire, _option(help="How names are spelled; all are heard.")] = "rmw_zenoh"
    interfaces: Interfaces = None

    def __post_init__(self) -> None:
        add_interfaces(self.interfaces)

    @property
    def by_wall_time(self) -> Joining:
        """The same, whatever --use-sim-time says."""
        return replace(self, use_sim_time=False, interfaces=None)

    @contextmanager
    def open(self, patience_s: float = _AT_ONCE_S, *, quietly: bool = False) -> Iterator[LiveBus]:
        """Join; raises BridgeError if nobody is there in this time [s], and says what it waits for."""
        from twin.bridge import live
        from twin.errors import NobodyAnswersError

        def join(timeout_s: float) -> AbstractContextManager[LiveBus]:
            return live.join(
                self.connect or None,
                config=self.config,
                domain_id=self.domain,
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
                if not quietly:
                    typer.echo(f"waiting: {fault}", err=True)
                process = ending.enter_context(join(patience_s - _AT_ONCE_S))
            yield process

    def graph(self) -> Graph:
        """Return who is in the graph, once it is whole; raises BridgeError if nobody is there."""
        with self.open() as process:
            return whole_graph(process.bus)


def joins(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command whose last parameter is `joining: Joining` the options of which that is made."""
    return quiet_pipe()(takes("joining", Joining)(command))


def on_graph(
    app: typer.Typer, name: str, command_line: str, **settings: Any
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add a command that joins, with an example below its help; `settings` are those of `app.command`."""
    add = app.command(name, epilog=example(command_line), **settings)
    return lambda command: add(joins(command))
