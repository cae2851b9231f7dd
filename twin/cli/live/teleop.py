"""`twin teleop`: drive a robot with keys or a gamepad."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.ros.joining import PATIENCE_S, Joining, joins
from twin.live.teleop.keys import HELP, Layout

if TYPE_CHECKING:
    from twin.bridge.live import LiveBus
    from twin.live.teleop.keys import Keys
    from twin.live.teleop.node import TeleopNode
    from twin.live.teleop.terminal import Terminal

_LOOK_S = 0.05


@joins
def teleop(
    layout: Annotated[
        Layout, typer.Option(help="Keys of teleop_twist_keyboard, or of turtlebot3_teleop.")
    ] = Layout.TWIST,
    speed: Annotated[
        float | None,
        typer.Option(metavar="M/S", min=0.001, help="Of driving.", show_default="0.5; turtlebot3 0.22"),
    ] = None,
    turn: Annotated[
        float | None,
        typer.Option(metavar="RAD/S", min=0.001, help="Of turning.", show_default="1.0; turtlebot3 2.84"),
    ] = None,
    dead_man: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="Without a key for so long it stops; 0: never.")
    ] = 0.7,
    topic: Annotated[
        str | None,
        typer.Option(
            metavar="TOPIC",
            help="Where to publish.",
            show_default="the first of guard/teleop, cmd_vel_teleop, cmd_vel, turtle1/cmd_vel that is heard",
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(metavar="NAME", help="Of the robot.", show_default="none")] = "",
    stamped: Annotated[
        bool | None,
        typer.Option(
            "--stamped/--unstamped", help="TwistStamped, or Twist.", show_default="what is asked for"
        ),
    ] = None,
    frame: Annotated[str, typer.Option(metavar="FRAME", help="Of stamped commands.")] = "",
    gamepad: Annotated[
        Path | None,
        typer.Option(metavar="DEVICE", help="Its left stick drives.", show_default="first /dev/input/js*"),
    ] = None,
    *,
    joining: Joining,
) -> None:
    """Drive a robot with keys or a gamepad.

    It stops when no key is pressed, at the end, and when the terminal closes. Ctrl-C ends it.
    """
    from twin.bridge.wire.interrupts import noted_signals
    from twin.cli.ros.joining import whole_graph
    from twin.live.teleop.gamepad import Gamepad
    from twin.live.teleop.keys import Keys, TeleopConfig
    from twin.live.teleop.node import TeleopNode, in_namespace, is_stamped, listened_to, nobody_listens
    from twin.live.teleop.terminal import single_keys

    burger = layout is Layout.TURTLEBOT3
    config = TeleopConfig(
        layout=layout,
        speed=speed or (0.22 if burger else 0.5),
        turn=turn or (2.84 if burger else 1.0),
        dead_man=dead_man,
    )
    keys = Keys(config)
    device = gamepad or Gamepad.first()
    with single_keys(sys.stdin.fileno()) as terminal, joining.by_wall_time.open(PATIENCE_S) as live:
        graph = whole_graph(live.bus)
        where = listened_to(graph, namespace) if topic is None else in_namespace(namespace, topic)
        if where is None:
            raise nobody_listens(namespace)
        stamps = is_stamped(graph, where) if stamped is None else stamped
        pad = None if device is None else Gamepad(device)
        node = TeleopNode(live.bus, keys, topic=where, stamped=stamps, frame=frame, gamepad=pad)
        kind = "TwistStamped" if stamps else "Twist"
        typer.echo(f"{HELP[layout]}\ndrives {node.topic} ({kind}); Ctrl-C ends it")
        if pad is not None:
            typer.echo(f"{pad.path}: hold the left shoulder button and move the left stick")
        with noted_signals() as received:
            try:
                _drive(live, node, keys, terminal, received)
            finally:  # a terminal that closes interrupts
                node.close()
        if terminal.is_open:
            typer.echo()


def _drive(live: LiveBus, node: TeleopNode, keys: Keys, terminal: Terminal, received: list[int]) -> None:
    shown = ""
    while not received and terminal.is_open:
        for key in terminal.pressed():
            node.press(key)
        live.spin_once(_LOOK_S)
        x, y, z, yaw = node.command
        words = f"x {x:+.2f}  y {y:+.2f}  z {z:+.2f} m/s  turn {yaw:+.2f} rad/s"
        words += f"   (keys: {keys.speed:.2f} m/s, {keys.turn:.2f} rad/s)"
        if words != shown:
            typer.echo(f"\r{words}\x1b[K", nl=False)
            shown = words
