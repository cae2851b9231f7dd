"""What is drawn of a graph: as text, for Graphviz and for Mermaid."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from twin.bridge.graph import Graph
from twin.bridge.wire.keys import mangle
from twin.cli.ros.node.graph import (
    GraphChoice,
    NodeGraph,
    Topic,
    check_dot,
    graphviz,
    mermaid,
    node_graph,
    svg,
    text,
)
from twin.errors import RecordingError

TOPICS = (Path(__file__).with_name("warehouse_topics.txt")).read_text("utf-8").split("\n")
"""Of a run of scenarios/warehouse.yaml: 'MP /amcl /amcl_pose' is a publisher; NN is a node."""


def warehouse(choice: GraphChoice | None = None) -> NodeGraph:
    tokens = []
    for number, line in enumerate(filter(None, TOPICS)):
        kind, node, *topic = line.split(" ")
        namespace, _, name = node.rpartition("/")
        token = f"@ros2_lv/0/aa/{node.replace('/', '')}/{number}/{kind}/%/{mangle(namespace) or '%'}/{name}"
        what = f"/{mangle(topic[0])}/std_msgs::msg::dds_::String_/RIHS01_0/::,10:,:,:,," if topic else ""
        tokens.append(token + what)
    return node_graph(Graph(tokens), choice or GraphChoice())


def test_dead_sinks_and_debug_topics_are_left_out_and_actions_are_one() -> None:
    names = {topic.name: topic for topic in warehouse().topics}
    assert "/scan" in names
    assert "/clock" not in names
    assert "/amcl_pose" not in names
    assert names["/navigate_to_pose/action_topics"].subscribers == ("/bt_navigator", "/mission")
    every = {t.name for t in warehouse(GraphChoice(hidden=True, debug=True, dead_sinks=True)).topics}
    assert {"/clock", "/amcl_pose", "/navigate_to_pose/_action/status"} <= every


def test_the_text_follows_one_message() -> None:
    lines = text(warehouse()).splitlines()
    at = lines.index("/twist_mux")
    assert lines[at + 1] == "  /cmd_vel -> /diff_drive_controller"
    nodes = text(warehouse(GraphChoice(nodes_only=True))).splitlines()
    assert nodes[nodes.index("/twist_mux") + 1] == "  -> /diff_drive_controller (/cmd_vel)"


def test_a_node_and_a_topic_of_one_name_are_two_boxes() -> None:
    graph = NodeGraph(
        nodes=("/clock",),
        topics=(Topic(name="/clock", type="t", publishers=("/clock",), subscribers=()),),
        choice=GraphChoice(),
    )
    assert '"n_/clock" -> "t_/clock";' in graphviz(graph)


CHOICES = [
    GraphChoice(),
    GraphChoice(nodes_only=True),
    GraphChoice(hidden=True, debug=True, dead_sinks=True),
]


@pytest.mark.parametrize("choice", CHOICES)
def test_every_kind_of_text_has_every_label_and_arrow_once(choice: GraphChoice) -> None:
    graph = warehouse(choice)
    topics = [] if choice.nodes_only else graph.topics
    labels = sorted([*graph.nodes, *(topic.name for topic in topics)])
    arrows = sum(len(topic.publishers) + len(topic.subscribers) for topic in topics) or len(
        graph.connections()
    )
    dot = graphviz(graph)
    assert sorted(re.findall(r'^"[nt]_\S+" \[label="(.*)"\];$', dot, re.MULTILINE)) == labels
    assert len(re.findall(r'^"[nt]_\S+" -> "[nt]_\S+"', dot, re.MULTILINE)) == arrows
    chart = mermaid(graph)
    shapes = dict(re.findall(r'^(\w+)[(\[]+"(.*)"[)\]]+$', chart, re.MULTILINE))
    assert sorted(shapes.values()) == labels
    ends = re.findall(r"^(\w+) -->(?:\|.*\|)? (\w+)$", chart, re.MULTILINE)
    assert len(ends) == len(set(ends)) == arrows
    assert {end for pair in ends for end in pair} <= set(shapes)
    assert chart == mermaid(warehouse(choice))


def test_a_chart_leads_from_the_publisher_by_the_topic_to_who_hears_it() -> None:
    graph = NodeGraph(
        nodes=("/ear", "/mouth"),
        topics=(Topic(name="/words", type="t", publishers=("/mouth",), subscribers=("/ear",)),),
        choice=GraphChoice(),
    )
    boxes = 'flowchart LR\nn0(["/ear"])\nn1(["/mouth"])\n'
    assert mermaid(graph) == boxes + 't0["/words"]\nn1 --> t0\nt0 --> n0\n'
    assert mermaid(replace(graph, choice=GraphChoice(nodes_only=True))) == boxes + 'n1 -->|"/words"| n0\n'


def test_names_cannot_end_a_label() -> None:
    evil = 'a"];\\'
    graph = NodeGraph(nodes=(evil,), topics=(), choice=GraphChoice())
    assert r'"n_a\"];\\" [label="a\"];\\"];' in graphviz(graph).splitlines()
    assert mermaid(graph).splitlines()[1] == 'n0(["a#quot;];\\"])'


def test_an_empty_graph_has_no_lines() -> None:
    empty = NodeGraph(nodes=(), topics=(), choice=GraphChoice())
    assert (text(empty), mermaid(empty)) == ("", "flowchart LR\n")


def program(folder: Path, script: str) -> None:
    folder.joinpath("dot").write_text(f"#!/bin/sh\n{script}\n")
    folder.joinpath("dot").chmod(0o755)


def test_a_picture_is_what_dot_makes_of_the_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    program(tmp_path, 'echo "$@"; cat')
    check_dot(tmp_path / "graph.svg")
    assert svg("digraph {}\n") == "-Tsvg\ndigraph {}\n"
    program(tmp_path, "echo Error: syntax error in line 1 >&2; exit 1")
    with pytest.raises(RecordingError, match=r"^dot cannot draw the graph: Error: syntax error in line 1$"):
        svg("nonsense")
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    with pytest.raises(RecordingError, match=r"graph.svg: .* package graphviz, which is not installed"):
        check_dot(tmp_path / "graph.svg")


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz is not installed")
@pytest.mark.parametrize("choice", CHOICES)
def test_graphviz_takes_our_text(choice: GraphChoice) -> None:
    ElementTree.fromstring(svg(graphviz(warehouse(choice))))
