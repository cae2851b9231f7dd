"""`twin node …` in a process of its own, about the nodes of another one."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

from twin.bridge import live
from twin.bridge.node.options import BARE

Twin = Callable[..., "subprocess.CompletedProcess[str]"]

GRAPH = "topic_graph.py"
NODES = ["/adder", "/other", "/robot/base", "/robot/sensors", "/talker"]


def test_nodes_are_listed_and_counted(twin: Twin) -> None:
    done = twin("node", "list")
    assert (done.stdout.splitlines(), done.stderr) == (NODES, "")
    assert twin("node", "list", "-c").stdout == "5\n"


def test_nodes_that_share_a_name_are_told(endpoint: str, twin: Twin) -> None:
    with live.join([endpoint]) as process:
        process.bus.create_node("talker", options=BARE)
        process.bus.create_node("_hidden", options=BARE)
        listed, info = twin("node", "list", "-a"), twin("node", "info", "/talker")
    assert listed.stdout.splitlines() == sorted([*NODES, "/talker", "/_hidden"])
    assert listed.stderr == (
        "WARNING: Be aware that there are nodes in the graph that share an exact name, which can have "
        "unintended side effects.\n"
    )
    assert info.stderr == (
        'There are 2 nodes in the graph with the exact name "/talker". '
        "You are seeing information about only one of them.\n"
    )


def test_info_has_ros2s_sections(twin: Twin) -> None:
    lines = twin("node", "info", "/adder").stdout.splitlines()
    assert lines[:2] == ["/adder", "  Subscribers:"]
    titles = [line for line in lines if line.startswith("  ") and not line.startswith("   ")]
    assert titles == [
        "  Subscribers:",
        "  Publishers:",
        "  Service Servers:",
        "  Service Clients:",
        "  Action Servers:",
        "  Action Clients:",
    ]
    servers = lines[lines.index("  Service Servers:") : lines.index("  Service Clients:")]
    assert "    /add_two_ints: example_interfaces/srv/AddTwoInts" in servers
    assert "    /adder/list_parameters: rcl_interfaces/srv/ListParameters" in servers
    assert not any("_action" in line for line in lines)
    actions = lines.index("  Action Servers:")
    assert lines[actions + 1 :] == [
        "    /fibonacci: example_interfaces/action/Fibonacci",
        "  Action Clients:",
        "",
    ]


def test_info_with_what_is_hidden(twin: Twin) -> None:
    lines = twin("node", "info", "talker", "--include-hidden").stdout.splitlines()
    assert "    /_secret: std_msgs/msg/String" in lines
    assert "    /fibonacci/_action/feedback: example_interfaces/action/Fibonacci_FeedbackMessage" in lines


def test_an_unknown_node_is_told_with_the_nearest_one(twin: Twin) -> None:
    done = twin("node", "info", "/robot/sensor")
    assert done.returncode == 2
    assert done.stderr.startswith(
        "error: Unable to find node '/robot/sensor'; did you mean '/robot/sensors'? Valid: /"
    )


def test_the_graph_as_text_shows_who_talks_to_whom(twin: Twin) -> None:
    assert twin("node", "graph").stdout.splitlines() == [
        "/adder",
        "  /fibonacci/action_topics -> /talker",
        "/other",
        "/robot/base",
        "/robot/sensors",
        "/talker",
    ]
    every = twin("node", "graph", "--include-dead-sinks").stdout.splitlines()
    assert "  /chatter -> nobody" in every
    assert every[-2:] == ["nobody", "  /robot/cmd_vel -> /robot/base"]
    assert not any("rosout" in line for line in every)


def test_the_graph_as_files(twin: Twin, tmp_path: Path) -> None:
    done = twin("node", "graph", "-o", str(tmp_path / "graph.mmd"))
    assert (done.returncode, done.stdout) == (0, "")
    chart = (tmp_path / "graph.mmd").read_text("utf-8")
    assert [name for name in (*NODES, "/fibonacci/action_topics") if f'"{name}"' not in chart] == []
    dot = twin("node", "graph", "-o", "-", "--nodes-only").stdout
    assert dot.startswith("digraph graphname {\n")
    assert '"n_/adder" -> "n_/talker" [label="/fibonacci/action_topics"];' in dot
    assert twin("node", "graph", "-o", "graph.png").returncode == 2
