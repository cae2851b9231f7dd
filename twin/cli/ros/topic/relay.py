"""`twin topic relay`, `throttle`, `drop`: a topic's messages on another topic, as topic_tools does."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.ros.endings import endless
from twin.cli.ros.joining import Joining, joins, on_graph
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.tools.relay import Gate
    from twin.cli.ros.topic.process import TopicProcess

Input = Annotated[str, typer.Argument(metavar="IN", help="Topic to take from.", show_default=False)]
Output = Annotated[str | None, typer.Argument(metavar="OUT", help="Topic to publish on.", show_default=False)]
WallTime = Annotated[bool, typer.Option("--wall-time", help="Wall time whatever --use-sim-time says.")]

throttle = typer.Typer(no_args_is_help=True, help="Pass fewer messages on: by number or by size.")


@joins
@endless
def relay(source: Input, target: Output = None, *, joining: Joining) -> None:
    """Pass every message on, undecoded; OUT is IN_relay unless named."""
    _run(joining, "relay", source, target, None)


@on_graph(throttle, "messages", "twin topic throttle messages /scan 5")
@endless
def throttle_messages(
    source: Input,
    rate: Annotated[
        float, typer.Argument(metavar="HZ", min=1e-6, help="Messages per second.", show_default=False)
    ],
    target: Output = None,
    wall_time: WallTime = False,
    *,
    joining: Joining,
) -> None:
    """Pass at most so many messages on in a second; OUT is IN_throttle unless named."""
    from twin.bridge.tools.relay import MessageThrottle

    joined = joining.by_wall_time if wall_time else joining
    _run(joined, "throttle", source, target, lambda process: MessageThrottle(rate, process.now_ns))


@on_graph(throttle, "bytes", "twin topic throttle bytes /scan 10000 1.0")
@endless
def throttle_bytes(
    source: Input,
    bytes_per_s: Annotated[
        int, typer.Argument(metavar="BYTES", min=1, help="Bytes per second.", show_default=False)
    ],
    window: Annotated[
        float,
        typer.Argument(metavar="WINDOW", min=1e-3, help="Seconds to add up over.", show_default=False),
    ],
    target: Output = None,
    wall_time: WallTime = False,
    *,
    joining: Joining,
) -> None:
    """Pass messages on until so many bytes went by in the window; OUT is IN_throttle unless named."""
    from twin.bridge.tools.relay import ByteThrottle

    joined = joining.by_wall_time if wall_time else joining
    _run(joined, "throttle", source, target, lambda _: ByteThrottle(bytes_per_s, window))


@joins
@endless
def drop(
    source: Input,
    x: Annotated[int, typer.Argument(metavar="X", min=0, help="So many are dropped …", show_default=False)],
    y: Annotated[int, typer.Argument(metavar="Y", min=1, help="… of so many.", show_default=False)],
    target: Output = None,
    *,
    joining: Joining,
) -> None:
    """Of every Y messages drop X and pass the others on; OUT is IN_drop unless named."""
    from twin.bridge.tools.relay import Drop

    if x > y:
        raise BridgeError(f"X is {x} and Y {y}: of {y} messages at most {y} can be dropped")
    _run(joining, "drop", source, target, lambda _: Drop(x, y))


def _run(
    joining: Joining, node: str, source: str, target: str | None, gate: Callable[[TopicProcess], Gate] | None
) -> None:
    from twin.bridge.tools.relay import Relay
    from twin.cli.ros.topic.process import open_topics

    with open_topics(joining, node_name=node) as process:
        passes = gate(process) if gate else None
        relay_ = Relay(process.node, process.graph, source, target or f"{source}_{node}", passes)
        process.wait_for_topic(relay_.source)
        typer.echo(f"{relay_.source} -> {relay_.target}")
        while True:
            relay_.update()
            process.live.spin_once()
