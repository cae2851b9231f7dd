from __future__ import annotations

import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.srvs import Trigger


def test_a_process_sees_more_of_its_own_endpoints_than_a_queue_of_zenoh_holds() -> None:
    with Bus.open(Clock()) as bus:
        node = bus.create_node("many")
        for number in range(400):
            node.create_service(Trigger, f"service_{number}", lambda request: None)
        assert len(Graph.snapshot(bus).services()) >= 400


def test_the_whole_graph_is_that_after_all_nodes_are_made(endpoint: str) -> None:
    """A busy machine may take long from a run's first node to its last one."""
    with Bus.open(Clock(), listen=[endpoint]) as bus, live.join([endpoint]) as other:
        bus.starting()
        bus.create_node("first")
        with ThreadPoolExecutor() as pool:
            looking = pool.submit(Graph.whole, other.bus)
            for number in range(20):
                bus.create_node(f"node_{number}")
            bus.started()
            found = looking.result()
        assert (len(found.nodes), found.lacks) == (21, "")


def test_who_does_not_get_to_an_end_is_not_waited_for_but_told(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as bus, live.join([endpoint]) as other:
        bus.starting()
        bus.create_node("first")
        found = Graph.whole(other.bus, timeout_s=0.0)
        assert [node.name for node in found.nodes] == ["first"]
        assert found.lacks == "somebody has been making nodes for more than 0 s"


_LISTENER = """
import sys
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
with Bus.open(Clock(), listen=[sys.argv[1]]) as bus:
    bus.create_node("first")
    print("ready", flush=True)
    sys.stdin.read()
"""


def test_an_answer_that_does_not_come_to_its_end_is_told(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = [sys.executable, "-c", _LISTENER, endpoint]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as there:
        assert there.stdout is not None
        assert there.stdout.readline() == "ready\n"
        with live.join([endpoint]) as other:
            assert Graph.whole(other.bus).lacks == ""
            there.send_signal(signal.SIGSTOP)
            monkeypatch.setattr("twin.bridge.graph._TIMEOUT_S", 0.1)
            assert Graph.snapshot(other.bus).lacks == "not everybody has told in 0.1 s who is there"
            there.send_signal(signal.SIGCONT)
        there.communicate()
