"""`twin topic list`, `info`, `type`, `find`: what is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

import typer

from twin.cli.ros.endpoint_text import endpoint_text
from twin.cli.ros.graph_names import known, of_type, print_names, print_types, shown
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.topic.options import TopicName

Hidden = Annotated[
    bool, typer.Option("--include-hidden-topics", help="Those with a part that begins with _ too.")
]
Count = Annotated[bool, typer.Option("--count-topics", "-c", help="Only say how many.")]


@joins
def list_topics(
    show_types: Annotated[bool, typer.Option("--show-types", "-t", help="Also show the types.")] = False,
    count: Count = False,
    hidden: Hidden = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Also show types, and how many publish and subscribe.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """List the topics."""
    graph = joining.graph()
    topics = shown(graph.topics(), hidden)
    if verbose and topics and not count:
        published = [(name, len(graph.publishers(name))) for name in topics]
        subscribed = [(name, len(graph.subscriptions(name))) for name in topics]
        typer.echo(_table("Published topics:", "publisher", published, topics))
        typer.echo(_table("Subscribed topics:", "subscriber", subscribed, topics))
    else:
        print_names(topics, count=count, show_types=show_types)


@joins
def info(
    topic: TopicName,
    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Also tell nodes, type hashes, GIDs, quality of service."),
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Tell type and number of publishers and subscriptions."""
    graph = joining.graph()
    name = known("topic", topic, graph.topics())
    types = graph.topics()[name]
    end = "\n\n" if verbose else "\n"
    for line, endpoints in (
        (f"Type: {types[0] if len(types) == 1 else list(types)}", ()),
        (f"Publisher count: {len(graph.publishers(name))}", graph.publishers(name)),
        (f"Subscription count: {len(graph.subscriptions(name))}", graph.subscriptions(name)),
    ):
        typer.echo(f"{line}{end}", nl=False)
        for endpoint in endpoints if verbose else ():
            typer.echo(f"{endpoint_text(endpoint)}{end}", nl=False)


@joins
def type_of(topic: TopicName, *, joining: Joining) -> None:
    """Print a topic's type."""
    print_types("topic", topic, joining.graph().topics())


@joins
def find(
    topic_type: Annotated[
        str, typer.Argument(metavar="TYPE", help="Such as std_msgs/msg/String.", show_default=False)
    ],
    count: Count = False,
    hidden: Hidden = False,
    *,
    joining: Joining,
) -> None:
    """List the topics of a type."""
    from twin.bridge import types

    wanted = types.full_name(topic_type)
    print_names(of_type(wanted, shown(joining.graph().topics(), hidden)), count=count)


def _table(
    title: str, word: str, counts: Sequence[tuple[str, int]], topics: Mapping[str, Sequence[str]]
) -> str:
    rows = [
        f" * {name} [{', '.join(topics[name])}] {count} {word}{'s' if count > 1 else ''}\n"
        for name, count in counts
        if count
    ]
    return f"{title}\n{''.join(rows)}"
