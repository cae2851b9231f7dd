"""`twin guard`: what stands between a robot and whoever commands it; stopping and releasing it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from twin.cli.option_groups import example
from twin.cli.ros.joining import PATIENCE_S, Joining, joins, on_graph, tool_node

if TYPE_CHECKING:
    from twin.bridge.live import LiveBus
    from twin.live.guard.client import GuardClient

app = typer.Typer(invoke_without_command=True, help="Guard a robot: limits, watchdog, emergency stop.")

Namespace = Annotated[str, typer.Option(metavar="NAME", help="Of the robot.", show_default="none")]
Patience = Annotated[float, typer.Option(metavar="S", min=0.0, help="Give up after so long.")]
_most = "As --robot says, else none"


@app.callback(epilog=example("twin guard --robot my_robot.urdf --max-speed 0.5"))
@joins
def guard(
    context: typer.Context,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT", help="File of the robot, or a name of `twin robots`: limits of its drive."
        ),
    ] = None,
    max_speed: Annotated[
        float | None, typer.Option(metavar="M/S", min=0.0, help="Over ground.", show_default=_most)
    ] = None,
    max_turn: Annotated[
        float | None, typer.Option(metavar="RAD/S", min=0.0, help="About z.", show_default=_most)
    ] = None,
    max_acceleration: Annotated[
        float | None, typer.Option(metavar="M/S²", min=1e-3, help="Along x and y.", show_default=_most)
    ] = None,
    max_turn_acceleration: Annotated[
        float | None, typer.Option(metavar="RAD/S²", min=1e-3, help="About z.", show_default=_most)
    ] = None,
    timeout: Annotated[
        float, typer.Option(metavar="S", min=0.01, help="Without a command for so long the robot is stopped.")
    ] = 0.5,
    max_age: Annotated[
        float,
        typer.Option(
            metavar="S", min=0.001, help="A command may be under way for so much longer than others."
        ),
    ] = 0.25,
    operator_hold: Annotated[
        float,
        typer.Option(
            metavar="S", min=0.0, help="So long after an operator's command autonomy's are refused."
        ),
    ] = 1.0,
    cmd_vel: Annotated[str, typer.Option(metavar="TOPIC", help="That the robot listens to.")] = "cmd_vel",
    commands: Annotated[str, typer.Option(metavar="TOPIC", help="Of autonomy's commands.")] = "~/cmd_vel",
    teleop: Annotated[str, typer.Option(metavar="TOPIC", help="Of the operator's commands.")] = "~/teleop",
    namespace: Namespace = "",
    released: Annotated[
        bool, typer.Option("--released", help="Let the robot move without a first `twin guard release`.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Guard a robot: limits, watchdog, emergency stop.

    It runs on the robot's computer, and alone publishes /cmd_vel. It starts stopped; Ctrl-C ends it.
    """
    if context.invoked_subcommand is not None:
        return
    from twin.bridge.graph import Graph
    from twin.bridge.programs.console_log import show_log
    from twin.bridge.wire.interrupts import noted_signals
    from twin.live.guard.gate import GateConfig
    from twin.live.guard.limits import drive_limits, limited
    from twin.live.guard.node import GuardNode, GuardTopics

    show_log()
    linear, angular = drive_limits(robot)
    config = GateConfig(
        linear=limited(linear, max_speed, max_acceleration),
        angular=limited(angular, max_turn, max_turn_acceleration),
        command_timeout=timeout,
        operator_hold=operator_hold,
        max_age=max_age,
    )
    topics = GuardTopics(cmd_vel=cmd_vel, commands=commands, teleop=teleop)
    with joining.by_wall_time.open(PATIENCE_S) as live, noted_signals() as received:
        node = GuardNode(live.bus, Graph.watch(live.bus), config, topics=topics, namespace=namespace)
        if released:
            node.gate.release(None, 0)
        typer.echo(f"{node.node.fully_qualified_name} guards {node.cmd_vel}: {config.words}; Ctrl-C ends it")
        live.spin(lambda: bool(received))
        node.close()


@on_graph(app, "stop", "twin guard stop")
def stop(namespace: Namespace = "", timeout: Patience = 10.0, *, joining: Joining) -> None:
    """Stop the robot at once, and until a release."""
    with _client(joining, namespace, "twin guard stop") as (process, client):
        request = client.stop()
        if not process.spin(lambda: request.verdict is not None, timeout):
            told = f"no guard has acknowledged the stop on {client.guard} in {timeout:g} s"
            _fail(f"{told}: use the robot's own switch")
    typer.echo("stopped; `twin guard release` lets it move again")


@on_graph(app, "release", "twin guard release")
def release(namespace: Namespace = "", timeout: Patience = 10.0, *, joining: Joining) -> None:
    """Let a stopped robot move again, by commands that come from now on."""
    with _client(joining, namespace, "twin guard release") as (process, client):
        process.spin(lambda: client.is_present, timeout)
        request = client.release()
        if request is None:
            _fail(_silent(client, timeout))
        process.spin(lambda: request.is_over(client.now_ns))
    if request.verdict is None:
        _fail(f"no guard has acknowledged the release on {client.guard}: look with `twin guard status`")
    if not request.is_accepted:
        _fail("the robot was stopped again meanwhile, and is not released")
    typer.echo("released")


@on_graph(app, "status", "twin guard status")
def status(namespace: Namespace = "", timeout: Patience = 10.0, *, joining: Joining) -> None:
    """Print who commands the robot or holds it stopped, and what became of commands."""
    with _client(joining, namespace, "twin guard status") as (process, client):
        process.spin(lambda: client.status is not None, timeout)
    if client.status is None:
        _fail(_silent(client, timeout))
    typer.echo(client.status.words)
    for verdict, count in sorted(client.status.verdicts.items()):
        typer.echo(f"commands {verdict}: {count}")


@contextmanager
def _client(joining: Joining, namespace: str, by: str) -> Iterator[tuple[LiveBus, GuardClient]]:
    from twin.live.guard.client import GuardClient

    with joining.by_wall_time.open() as process:
        guard = f"/{namespace.strip('/')}/guard".replace("//", "/")
        yield process, GuardClient(tool_node(process.bus, "guard"), guard=guard, by=by)


def _silent(client: GuardClient, timeout_s: float) -> str:
    return (
        f"no guard has told its state on {client.guard}/status in {timeout_s:g} s; is `twin guard` running?"
    )


def _fail(sentence: str) -> NoReturn:
    from twin.cli.console import print_error
    from twin.errors import TwinError

    print_error(TwinError(sentence))
    raise typer.Exit(1)
