"""What rqt_graph shows: nodes, and the topics by which they are connected; as text, DOT, Mermaid or SVG.

Source of what is shown: rqt_graph, dotcode.py (active topics; dead sinks and debug topics hidden, the
topics of an action as one).
"""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import RecordingError
from twin.tree_drawing import escaped, quoted

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo, Graph

DEBUG_TOPICS = ("/clock", "/parameter_events", "/rosout", "/statistics")
"""Left out by rqt_graph unless it is told otherwise."""
_ACTION = "/_action/"


@dataclass(frozen=True, kw_only=True)
class GraphChoice:
    """What is shown."""

    nodes_only: bool = False
    """Nodes with arrows between them instead of topics."""
    hidden: bool = False
    """Names with a part that begins with _ too; the topics of actions one by one."""
    debug: bool = False
    """/clock, /rosout and /parameter_events too."""
    dead_sinks: bool = False
    """Topics that have only publishers, or only subscriptions, too."""


@dataclass(frozen=True, kw_only=True)
class Topic:
    """A topic, or the topics of an action."""

    name: str
    type: str
    publishers: tuple[str, ...]
    """Full names of nodes, sorted, each once."""
    subscribers: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class NodeGraph:
    """Nodes by full name and topics, sorted."""

    nodes: tuple[str, ...]
    topics: tuple[Topic, ...]
    choice: GraphChoice

    def connections(self) -> dict[tuple[str, str], tuple[str, ...]]:
        """Return by which topics one node leads to another."""
        found: dict[tuple[str, str], list[str]] = {}
        for topic in self.topics:
            for a in topic.publishers:
                for b in topic.subscribers:
                    found.setdefault((a, b), []).append(topic.name)
        return {pair: tuple(names) for pair, names in sorted(found.items())}


def node_graph(graph: Graph, choice: GraphChoice) -> NodeGraph:
    """Return what is to be shown of a graph."""
    nodes = {node.full_name for node in graph.nodes if choice.hidden or not node.name.startswith("_")}
    publishers: dict[str, set[str]] = {}
    subscribers: dict[str, set[str]] = {}
    types: dict[str, set[str]] = {}
    for endpoint in graph.endpoints:
        name = _shown_as(endpoint, choice)
        if name is None or endpoint.node.full_name not in nodes:
            continue
        side = publishers if endpoint.kind == "MP" else subscribers
        side.setdefault(name, set()).add(endpoint.node.full_name)
        types.setdefault(name, set()).add(endpoint.type)
    topics = []
    for name in sorted(types):
        given, taken = publishers.get(name, set()), subscribers.get(name, set())
        if (given and taken) or choice.dead_sinks:
            topics.append(
                Topic(
                    name=name,
                    type=", ".join(sorted(types[name])),
                    publishers=tuple(sorted(given)),
                    subscribers=tuple(sorted(taken)),
                )
            )
    return NodeGraph(nodes=tuple(sorted(nodes)), topics=tuple(topics), choice=choice)


def text(graph: NodeGraph) -> str:
    """Return the graph as lines: each node, what it publishes, and who listens."""
    lines = []
    for node in graph.nodes:
        lines.append(node)
        if graph.choice.nodes_only:
            for (a, b), names in graph.connections().items():
                lines += [f"  -> {b} ({', '.join(names)})"] if a == node else []
            continue
        for topic in graph.topics:
            if node in topic.publishers:
                lines.append(f"  {topic.name} -> {', '.join(topic.subscribers) or 'nobody'}")
    if not graph.choice.nodes_only:
        lines += [
            f"nobody\n  {topic.name} -> {', '.join(topic.subscribers)}"
            for topic in graph.topics
            if not topic.publishers
        ]
    return "".join(f"{line}\n" for line in lines)


def graphviz(graph: NodeGraph) -> str:
    """Return the graph as a .gv file with rqt_graph's shapes: nodes are ellipses, topics boxes."""
    lines = ["digraph graphname {", "rankdir=LR;", "node [shape=ellipse];"]
    lines += [f"{_id('n', node)} [label={quoted(node)}];" for node in graph.nodes]
    if graph.choice.nodes_only:
        for (a, b), names in graph.connections().items():
            label = "\\n".join(map(escaped, names))
            lines.append(f'{_id("n", a)} -> {_id("n", b)} [label="{label}"];')
    else:
        lines.append("node [shape=box];")
        lines += [f"{_id('t', topic.name)} [label={quoted(topic.name)}];" for topic in graph.topics]
        for topic in graph.topics:
            lines += [f"{_id('n', node)} -> {_id('t', topic.name)};" for node in topic.publishers]
            lines += [f"{_id('t', topic.name)} -> {_id('n', node)};" for node in topic.subscribers]
    return "\n".join([*lines, "}"]) + "\n"


def check_dot(output: Path) -> None:
    """Refuse to draw where Graphviz is missing.

    Raises:
        RecordingError: there is no `dot`.
    """
    if shutil.which("dot") is None:
        raise RecordingError(
            f"--output {output}: an .svg is drawn by dot, of the package graphviz, which is not installed; "
            "valid without it: .gv, .mmd"
        )


def svg(graphviz: str) -> str:
    """Return the drawing.

    Raises:
        RecordingError: `dot` cannot draw it.
    """
    done = subprocess.run(["dot", "-Tsvg"], input=graphviz, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RecordingError(f"dot cannot draw the graph: {' '.join(done.stderr.split())}")
    return done.stdout


def mermaid(graph: NodeGraph) -> str:
    """Return the graph as a flowchart of Mermaid, which pages of Markdown draw: nodes round, topics boxes."""
    number = {name: f"n{i}" for i, name in enumerate(graph.nodes)}
    lines = ["flowchart LR", *(f"{number[node]}([{_entity(node)}])" for node in graph.nodes)]
    if graph.choice.nodes_only:
        for (a, b), names in graph.connections().items():
            lines.append(f"{number[a]} -->|{_entity(*names)}| {number[b]}")
        return "".join(f"{line}\n" for line in lines)
    for i, topic in enumerate(graph.topics):
        lines.append(f"t{i}[{_entity(topic.name)}]")
        lines += [f"{number[node]} --> t{i}" for node in topic.publishers]
        lines += [f"t{i} --> {number[node]}" for node in topic.subscribers]
    return "".join(f"{line}\n" for line in lines)


def _shown_as(endpoint: EndpointInfo, choice: GraphChoice) -> str | None:
    """Return the name under which an endpoint's topic is shown; None if it is left out."""
    from twin.bridge.graph import is_hidden

    name = endpoint.name
    if endpoint.kind not in ("MP", "MS") or (name in DEBUG_TOPICS and not choice.debug):
        return None
    if choice.hidden:
        return name
    action, is_action, _ = name.partition(_ACTION)
    if is_action and not is_hidden(action):
        return f"{action}/action_topics"
    return None if is_hidden(name) else name


def _id(kind: str, name: str) -> str:
    return quoted(f"{kind}_{name}")


def _entity(*names: str) -> str:
    """Return a text of Mermaid, a line for each name; what would end it or be taken for HTML has names."""
    lines = [
        name.replace("#", "#35;").replace('"', "#quot;").replace("<", "#lt;").replace(">", "#gt;")
        for name in names
    ]
    return f'"{"<br>".join(lines)}"'
