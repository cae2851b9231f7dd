"""`twin topic list`, `info`, `type`, `find`: what is there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.ros.endpoint_text import endpoint_text
from twin.cli.ros.graph_names import absolute, unknown
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.topic.options import TopicName

if TYPE_CHECKING:
    from twin.bridge.graph import Graph

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
    graph, topics = _topics(joining, hidden)
    if count:
        typer.echo(len(topics))
    elif verbose and topics:
        published = [(name, len(graph.publishers(name))) for name in topics]
        subscribed = [(name, len(graph.subscriptions(name))) for name in topics]
        typer.echo(_table("Published topics:", "publisher", published, topics))
        typer.echo(_table("Subscribed topics:", "subscriber", subscribed, topics))
    else:
        for name, types in topics.items():
            typer.echo(f"{name} [{', '.join(types)}]" if show_types else name)


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
    graph, topics = _topics(joining, True)
    name, types = _known(topic, topics)
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
    _, topics = _topics(joining, True)
    for name in _known(topic, topics)[1]:
        typer.echo(name)


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
    _, topics = _topics(joining, hidden)
    found = [name for name, known in topics.items() if wanted in known]
    if count:
        typer.echo(len(found))
        return
    for name in found:
        typer.echo(name)


def _topics(joining: Joining, hidden: bool) -> tuple[Graph, dict[str, tuple[str, ...]]]:
    from twin.bridge.graph import is_hidden

    graph = joining.graph()
    topics = graph.topics()
    return graph, {name: types for name, types in topics.items() if hidden or not is_hidden(name)}


def _known(topic: str, topics: dict[str, tuple[str, ...]]) -> tuple[str, tuple[str, ...]]:
    name = absolute(topic)
    if name not in topics:
        raise unknown("topic", topic, topics)
    return name, topics[name]


def _table(
    title: str, word: str, counts: Sequence[tuple[str, int]], topics: dict[str, tuple[str, ...]]
) -> str:
    rows = [
        f" * {name} [{', '.join(topics[name])}] {count} {word}{'s' if count > 1 else ''}\n"
        for name, count in counts
        if count
    ]
    return f"{title}\n{''.join(rows)}"
