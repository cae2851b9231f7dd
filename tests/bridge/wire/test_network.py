from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.processes import wait_for
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import String, Twist
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import AddTwoInts
from twin.errors import BridgeError

PEER = Path(__file__).with_name("raw_peer.py")


@pytest.fixture
def open_bus(endpoint: str) -> Iterator[Bus]:
    with Bus.open(Clock(), listen=[endpoint]) as bus:
        yield bus


def _peer(endpoint: str, what: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, str(PEER), endpoint, what], stdout=subprocess.PIPE, text=True)


def test_another_process_drives(open_bus: Bus, endpoint: str) -> None:
    node = open_bus.create_node("base")
    got: list[float] = []
    node.create_subscription(Twist, "cmd_vel", lambda m: got.append(m.linear.x))
    with _peer(endpoint, "send") as peer:
        assert peer.wait(100) == 0
    open_bus.spin()
    assert got == []  # nothing enters between admissions
    wait_for(lambda: open_bus.external.waiting == 3)
    assert open_bus.admit() == 3
    open_bus.spin()
    assert got == [1.0, 2.0, 1.5]  # by source, then sequence; not by arrival
    assert dict(open_bus.refused) == {}


def test_garbage_from_outside_is_counted_and_reported(
    open_bus: Bus, endpoint: str, caplog: pytest.LogCaptureFixture
) -> None:
    node = open_bus.create_node("base")
    got: list[float] = []
    node.create_subscription(Twist, "cmd_vel", lambda m: got.append(m.linear.x))
    node.create_subscription(String, "chatter", lambda m: got.append(-1.0))

    def step() -> bool:
        open_bus.admit()
        open_bus.spin()
        return got == [7.0] and sum(open_bus.refused.values()) == 7

    with _peer(endpoint, "garbage") as peer:
        assert peer.wait(100) == 0
        wait_for(step)
    open_bus.admit()
    assert dict(open_bus.refused) == {"attachment": 2, "payload": 3, "type hash": 1, "type": 1}
    assert got == [7.0]
    reports = [r.message for r in caplog.records if "from outside was dropped" in r.message]
    assert len(reports) == 5  # each reason once per topic
    assert any("RIHS01_dead instead of RIHS01_9c45" in report for report in reports)
    assert any("geometry_msgs::msg::dds_::Accel_ instead of" in report for report in reports)


def test_another_process_calls_a_service(open_bus: Bus, endpoint: str) -> None:
    open_bus.create_node("adder").create_service(
        AddTwoInts, "add_two_ints", lambda request: AddTwoInts.Response(request.a + request.b)
    )
    with _peer(endpoint, "call") as peer:

        def step() -> bool:
            open_bus.admit()
            open_bus.spin()
            return peer.poll() is not None

        wait_for(step)
        assert peer.stdout is not None
        assert peer.stdout.read() == "42\n"
        assert peer.returncode == 0


def test_another_process_listens(open_bus: Bus, endpoint: str) -> None:
    publisher = open_bus.create_node("talker").create_publisher(String, "chatter")
    with _peer(endpoint, "listen") as peer:
        wait_for(lambda: publisher.has_subscribers)
        publisher.publish(String("hi"))
        assert peer.stdout is not None
        assert peer.stdout.read() == "00010000" + "03000000" + "686900" + " 33\n"


def test_two_buses_meet(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as here, Bus.open(Clock(), connect=[endpoint]) as there:
        got: list[str] = []
        here.create_node("listener").create_subscription(String, "chatter", lambda m: got.append(m.data))
        talker = there.create_node("talker")
        talker.create_publisher(String, "map", LATCHED).publish(String("the map"))
        publisher = talker.create_publisher(String, "chatter")
        wait_for(lambda: publisher.has_subscribers)
        publisher.publish(String("hello"))

        def step() -> bool:
            here.admit()
            here.spin()
            return bool(got)

        wait_for(step)
        assert got == ["hello"]
        here.create_node("late").create_subscription(String, "map", lambda m: got.append(m.data), LATCHED)

        def latched() -> bool:
            step()
            return len(got) > 1

        wait_for(latched)
        assert got == ["hello", "the map"]
        assert here.session_id != there.session_id


def test_a_graph_of_many_endpoints_is_seen_from_inside(open_bus: Bus) -> None:
    """Zenoh's default channel holds 256 replies, and the own tokens are replied in the thread that asks."""
    node = open_bus.create_node("much")
    for number in range(300):
        node.create_publisher(String, f"topic_{number}")
    assert sum(name.startswith("/topic_") for name in Graph.snapshot(open_bus).topics()) == 300


def test_a_port_in_use_is_named(open_bus: Bus, endpoint: str) -> None:
    with pytest.raises(BridgeError, match=endpoint):
        Bus.open(Clock(), listen=[endpoint])


def test_a_malformed_endpoint_is_named() -> None:
    with pytest.raises(BridgeError, match=r"tcp-127\.0\.0\.1.*looks like tcp/127\.0\.0\.1:7447"):
        Bus.open(Clock(), listen=["tcp-127.0.0.1:7447"])


def test_nothing_listens_by_default() -> None:
    script = (
        "import os, sys\n"
        "from twin.bridge.bus import Bus\n"
        "from twin.bridge.clock import Clock\n"
        "with Bus.open(Clock()) as bus:\n"
        "    fds = [os.readlink(f'/proc/self/fd/{n}') for n in os.listdir('/proc/self/fd')\n"
        "           if os.path.exists(f'/proc/self/fd/{n}')]\n"
        "sys.exit(any('socket' in fd for fd in fds))\n"
    )
    if not Path("/proc/self/fd").exists():
        pytest.skip("needs /proc")
    assert subprocess.run([sys.executable, "-c", script], timeout=120, check=False).returncode == 0


@pytest.mark.parametrize("listen", [True, False])
def test_a_forgotten_bus_does_not_hang_the_interpreter(listen: bool, endpoint: str) -> None:
    script = (
        "from twin.bridge.bus import Bus\n"
        "from twin.bridge.clock import Clock\n"
        "from twin.bridge.msgs import String\n"
        "from twin.bridge.qos import LATCHED\n"
        f"bus = Bus.open(Clock(), listen={[endpoint] if listen else []})\n"
        "node = bus.create_node('a')\n"
        "node.create_subscription(String, 'x', print)\n"
        "node.create_subscription(String, 'y', print, LATCHED)\n"
        "node.create_publisher(String, 'y', LATCHED).publish(String('z'))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], timeout=120, check=False, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
