"""`twin topic`: what is published, by whom, how often."""

from __future__ import annotations

from typing import Annotated

import typer

from twin.cli.ros.joining import Joining, joins

app = typer.Typer(no_args_is_help=True, help="Topics: list, look, measure, publish; as `ros2 topic`.")


@app.command("list", epilog="Example: [bold]twin topic list -t[/bold]")
@joins
def list_topics(
    show_types: Annotated[bool, typer.Option("--show-types", "-t", help="Also show the types.")] = False,
    count: Annotated[bool, typer.Option("--count-topics", "-c", help="Only show how many.")] = False,
    hidden: Annotated[bool, typer.Option("--include-hidden-topics", help="Those of actions too.")] = False,
    *,
    joining: Joining,
) -> None:
    """List the topics."""
    from twin.bridge.graph import Graph, is_hidden

    with joining.open() as process:
        topics = Graph.snapshot(process.bus).topics()
    shown = {name: types for name, types in topics.items() if hidden or not is_hidden(name)}
    if count:
        typer.echo(len(shown))
        return
    for name, types in shown.items():
        typer.echo(f"{name} [{', '.join(types)}]" if show_types else name)
