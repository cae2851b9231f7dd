"""`twin bag rerun`: a user's nodes again on what a bag holds; do they say the same?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.ros.joining import Factory, Interfaces, add_interfaces
from twin.errors import RecordingError

if TYPE_CHECKING:
    from twin.bridge.bags.replay import Replayed
    from twin.bridge.bus import Bus

Bag = Annotated[Path, typer.Argument(metavar="BAG", help="Folder of a bag, or a .mcap, .db3 or .bag file.")]


def rerun(
    bag: Bag,
    place: Factory,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topics", metavar="TOPIC", help="Only this as input; repeatable.", show_default="all"),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--outputs",
            metavar="TOPIC",
            help="What only these nodes published, for a bag that does not tell; repeatable.",
            show_default="what they publish and the bag has from one publisher",
        ),
    ] = None,
    params_file: Annotated[
        list[Path] | None,
        typer.Option("--params-file", metavar="FILE", help="Parameters of the nodes; repeatable."),
    ] = None,
    interfaces: Interfaces = None,
) -> None:
    """Run nodes on a bag, on its time, and compare what they publish with what they had published.

    The exit code is 0 if every message is identical, 1 if not.
    """
    from twin.bridge.bags.reader import BagReader
    from twin.bridge.bags.replay import replay
    from twin.bridge.node.options import NodeOptions
    from twin.bridge.programs import ros_args
    from twin.bridge.programs.console_log import show_warnings
    from twin.bridge.programs.factory import create_nodes
    from twin.plugins import execution

    show_warnings()
    add_interfaces(interfaces)
    options = [word for file in params_file or () for word in ("--params-file", str(file))]
    arguments = ros_args.parse(["--ros-args", *options])

    def make(bus: Bus) -> None:
        bus.node_options = NodeOptions(arguments=arguments)
        create_nodes(bus, place)

    with execution(), BagReader(bag) as reader:
        for name in (*(topics or ()), *(outputs or ())):
            if name not in reader.topics:
                raise reader.no_topic(name)
        again = replay(reader, make, outputs=outputs, topics=topics)
    _report(bag, place, again)


def _report(bag: Path, place: str, again: Replayed) -> None:
    if not again.recorded:
        raise RecordingError(
            f"{bag}: has nothing that the nodes of {place} had published; name what is theirs with --outputs"
        )
    difference = again.difference
    if difference is not None:
        typer.echo(difference)
        raise typer.Exit(1)
    typer.echo(f"{len(again.published)} of {len(again.recorded)} messages identical")
