"""What is drawn of a graph, and that the drawing can be read: nothing lies on a label."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from twin.bridge.graph import Graph
from twin.bridge.wire.keys import mangle
from twin.cli.ros.node.drawing import svg
from twin.cli.ros.node.graph import GraphChoice, NodeGraph, Topic, graphviz, node_graph, text
from twin.cli.ros.node.layout import GAP_Y, LINE_GAP, Edge, Layout, Size, lay_out

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


SVG = "{http://www.w3.org/2000/svg}"
CHOICES = [
    GraphChoice(),
    GraphChoice(nodes_only=True),
    GraphChoice(hidden=True, debug=True, dead_sinks=True),
]


@pytest.mark.parametrize("choice", CHOICES)
def test_the_drawing_of_the_warehouse_shows_every_label_once(choice: GraphChoice) -> None:
    graph = warehouse(choice)
    drawing = svg(graph)
    assert drawing == svg(warehouse(choice))
    labels = [element.text for element in ElementTree.fromstring(drawing).iter(f"{SVG}text")]
    topics = [] if choice.nodes_only else [topic.name for topic in graph.topics]
    assert sorted(filter(None, labels)) == sorted([*graph.nodes, *topics])


def test_an_empty_graph_can_be_drawn() -> None:
    empty = NodeGraph(nodes=(), topics=(), choice=GraphChoice())
    ElementTree.fromstring(svg(empty))
    assert text(empty) == ""


def random_graph(seed: int) -> tuple[list[Size], list[Edge]]:
    """Return up to 40 vertices and edges that cross layers, close cycles and skip vertices."""
    numbers = random.Random(seed)
    count = numbers.randint(2, 40)
    sizes = [(float(numbers.randint(40, 300)), 30.0) for _ in range(count)]
    pairs = {(numbers.randrange(count), numbers.randrange(count)) for _ in range(numbers.randint(1, 70))}
    return sizes, sorted((a, b) for a, b in pairs if (a != b and (b, a) not in pairs) or a < b)


def lines_of(layout: Layout) -> Iterator[tuple[Edge, tuple[float, float, float]]]:
    """Yield the straight parts of edges: from x0 to x1 at y; what is between them is between layers."""
    for edge, points in layout.paths.items():
        for point in points:
            yield edge, (min(point.x0, point.x1), max(point.x0, point.x1), point.y)


@pytest.mark.parametrize("seed", range(25))
def test_labels_do_not_touch_and_no_edge_crosses_one(seed: int) -> None:
    sizes, edges = random_graph(seed)
    layout = lay_out(sizes, edges)
    assert set(layout.paths) == set(edges)
    boxes = [(x - w / 2, x + w / 2, y, h) for (x, y), (w, h) in zip(layout.places, sizes, strict=True)]
    for (l0, r0, y0, h), (l1, r1, y1, _) in itertools.combinations(boxes, 2):
        assert r0 <= l1 or r1 <= l0 or abs(y0 - y1) >= h + GAP_Y - 1e-6
    for edge, (x0, x1, y) in lines_of(layout):
        for v, (left, right, middle, height) in enumerate(boxes):
            if v not in edge:
                assert x1 <= left or right <= x0 or abs(y - middle) >= height / 2 + LINE_GAP - 1e-6


def test_edges_lead_from_left_to_right_but_for_one_of_a_cycle() -> None:
    sizes = [(50.0, 30.0)] * 4
    layout = lay_out(sizes, [(0, 1), (1, 2), (2, 0), (2, 3)])
    assert len(layout.turned) == 1
    for (a, b), points in layout.paths.items():
        rightwards = points[0].x0 < points[-1].x1
        assert rightwards is ((a, b) not in layout.turned)


def test_a_chain_is_one_straight_line() -> None:
    layout = lay_out([(60.0, 30.0)] * 5, [(0, 1), (1, 2), (2, 3), (3, 4)])
    assert {round(y, 6) for _, y in layout.places} == {15.0}
