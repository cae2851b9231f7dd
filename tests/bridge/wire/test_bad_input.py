"""Whatever others send, or stop doing: counted, reported once, and the bus goes on."""

from __future__ import annotations

import os
import resource
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh

from tests.bridge.wire.peer import (
    ADD,
    ADD_HASH,
    STRING,
    STRING_HASH,
    attachment,
    matched,
    raw_session,
    string,
)
from tests.processes import wait_for
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import LaserScan, OccupancyGrid, String, TFMessage, TransformStamped, new
from twin.bridge.qos import QoS
from twin.bridge.srvs import AddTwoInts
from twin.bridge.wire.admission import read
from twin.bridge.wire.external import ExternalQueue

CHATTER = f"{STRING}/{STRING_HASH}"


@pytest.fixture
def bus(endpoint: str) -> Iterator[Bus]:
    with Bus.open(Clock(), listen=[endpoint]) as opened:
        yield opened


def _spin(bus: Bus) -> bool:
    bus.admit()
    bus.spin()
    return True


def _process(script: str, *arguments: str) -> subprocess.Popen[str]:
    """Another process, which prints a line when it is ready."""
    process = subprocess.Popen(
        [sys.executable, "-c", script, *arguments],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    )
    assert process.stdout is not None
    process.stdout.readline()
    return process


def test_a_flood_is_bounded_counted_and_reported_once(
    bus: Bus, endpoint: str, caplog: pytest.LogCaptureFixture
) -> None:
    got: list[str] = []
    node = bus.create_node("a")
    node.create_subscription(String, "chatter", lambda m: got.append(m.data), QoS(history="keep_all"))
    node.create_subscription(String, "quiet", lambda m: got.append(m.data))
    with raw_session(endpoint) as peer:
        matched(peer, CHATTER.replace("chatter", "quiet")).put(string("quiet"), attachment=attachment(1))
        publisher = matched(peer, CHATTER)
        for number in range(100_000):
            publisher.put(string(f"{number}"), attachment=attachment(number + 1))
        wait_for(lambda: bus.refused["overflow"] == 90_001)
        assert bus.external.waiting == 10_000
    _spin(bus)
    assert got.count("quiet") == 1  # the flooded topic alone loses
    assert got[-1 if got[0] == "quiet" else -2] == "99999"
    assert len(got) == 10_000
    assert len([r for r in caplog.records if "overflow: more than 10000 samples" in r.message]) == 1


def test_large_samples_are_bounded_in_bytes(bus: Bus, endpoint: str) -> None:
    bus.external = ExternalQueue(depth=1000, max_bytes=2**20)
    bus.create_node("a").create_subscription(String, "chatter", print)
    with raw_session(endpoint) as peer:
        publisher = matched(peer, CHATTER)
        for number in range(30):
            publisher.put(string("x" * 100_000), attachment=attachment(number + 1))
        wait_for(lambda: sum(bus.external.refused.values()) == 20)
        assert bus.external.waiting == 10


def _broken_payloads() -> Iterator[tuple[type, bytes]]:
    """Truncations at every place, and every four bytes as a huge length."""
    transforms = TFMessage([new(TransformStamped, child_frame_id="base") for _ in range(3)])
    scan = new(LaserScan, ranges=np.zeros(9, np.float32))
    grid = new(OccupancyGrid, data=np.zeros(20, np.int8))
    for message in (transforms, scan, grid, String("hello")):
        payload = codec(type(message)).encode(message)
        for cut in range(len(payload)):
            yield type(message), payload[:cut]
        for place in range(4, len(payload) - 3, 4):
            for length in (b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x00\x00\x00\x10"):
                yield type(message), payload[:place] + length + payload[place + 4 :]


def test_truncated_and_exaggerating_payloads_end_at_once() -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    outcomes = {"decoded": 0, "refused": 0}
    for message_type, payload in _broken_payloads():
        start = time.process_time()
        try:
            codec(message_type).decode(payload)
            outcomes["decoded"] += 1  # numbers may be anything
        except Exception:
            outcomes["refused"] += 1
        assert time.process_time() - start < 1.0
    assert outcomes["refused"] > 500
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # [KiB]


_SERVER = f"""
import sys, time, zenoh
from tests.bridge.wire.peer import raw_session
kept = []
with raw_session(sys.argv[1]) as session:
    queryable = session.declare_queryable("{ADD}/{ADD_HASH}", kept.append, complete=True)
    token = session.liveliness().declare_token("@ros2_lv/0/ab/0/0/NN/%/%/server")
    print("ready", flush=True)
    time.sleep(60)
"""


def test_a_server_that_is_killed_leaves_no_request_open(bus: Bus, endpoint: str) -> None:
    client = bus.create_node("asker").create_client(AddTwoInts, "add")
    graph = Graph.watch(bus)
    with _process(_SERVER, endpoint) as server:
        wait_for(lambda: client.service_is_ready)
        wait_for(lambda: "server" in [node.name for node in graph.nodes])
        future = client.call_async(AddTwoInts.Request(1, 2))
        for _ in range(20):
            _spin(bus)
        assert not future.done  # it keeps the request
        server.kill()
        wait_for(lambda: _spin(bus) and future.done)
        assert future.error == "nobody answered on the service /add; is its node running?"
        wait_for(lambda: "server" not in [node.name for node in graph.nodes])
    graph.close()


def test_a_query_that_is_dropped_and_one_with_garbage(bus: Bus, endpoint: str) -> None:
    calls: list[object] = []
    bus.create_node("adder").create_service(AddTwoInts, "add", calls.append)
    client = bus.create_node("asker").create_client(AddTwoInts, "other")
    with raw_session(endpoint) as peer:
        queryable = peer.declare_queryable(
            f"{ADD}/{ADD_HASH}".replace("/add/", "/other/"), lambda query: query.drop(), complete=True
        )
        wait_for(lambda: client.service_is_ready)
        future = client.call_async(AddTwoInts.Request(1, 2))
        wait_for(lambda: _spin(bus) and future.done)
        assert future.error is not None
        queryable.undeclare()
        ended: list[bool] = []
        wait_for(lambda: list(peer.liveliness().get("@ros2_lv/0/*/*/*/SS/**")))
        for key, payload, extra in (
            (f"{ADD}/{ADD_HASH}", b"\0\1\0\0short", attachment(1)),
            (f"{ADD}/{ADD_HASH}", None, attachment(1)),
            (f"{ADD}/{ADD_HASH}", b"\0\1\0\0" + bytes(16), b"no attachment"),
            (f"{ADD}/RIHS01_dead", b"\0\1\0\0" + bytes(16), attachment(1)),
            (f"{ADD.replace('AddTwoInts', 'Other')}/RIHS01_dead", b"", attachment(1)),
            ("add", b"garbage", None),
        ):
            handler = zenoh.handlers.Callback(lambda reply: None, lambda: ended.append(True))
            peer.get(key, handler, payload=payload, attachment=extra, target=zenoh.QueryTarget.ALL)
        wait_for(lambda: _spin(bus) and len(ended) == 6)  # nobody waits for an answer
    assert calls == []
    assert dict(bus.refused) == {"payload": 3, "attachment": 1, "type hash": 1, "type": 1}


def test_bytes_after_messages_are_ignored_counted_and_said_once(
    bus: Bus, endpoint: str, caplog: pytest.LogCaptureFixture
) -> None:
    """As ROS 2's serializer leaves them: on topics, in requests and in responses."""
    heard: list[str] = []
    node = bus.create_node("a")
    node.create_subscription(String, "chatter", lambda m: heard.append(m.data))
    node.create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
    client = node.create_client(AddTwoInts, "other")
    rest, numbers = b"\xa5" * 24, b"\0\1\0\0" + struct.pack("<qq", 1, 2)
    with raw_session(endpoint) as peer:
        peer.declare_queryable(
            f"{ADD}/{ADD_HASH}".replace("/add/", "/other/"),
            lambda query: query.reply(query.key_expr, numbers[:4] + bytes([7]) + bytes(7) + rest),
            complete=True,
        )
        publisher = matched(peer, CHATTER)
        for number, left in enumerate((b"", b"\xa5" * 3, rest, rest)):  # three may fill the last word
            publisher.put(string("abcd" * number) + left, attachment=attachment(number + 1))
        sums: list[bytes] = []
        wait_for(lambda: list(peer.liveliness().get("@ros2_lv/0/*/*/*/SS/**")))
        peer.get(
            f"{ADD}/{ADD_HASH}",
            lambda reply: sums.append(reply.ok.payload.to_bytes()),
            payload=numbers + rest,
            attachment=attachment(1),
            target=zenoh.QueryTarget.ALL,
        )
        wait_for(lambda: client.service_is_ready)
        future = client.call_async(AddTwoInts.Request(1, 2))
        wait_for(lambda: _spin(bus) and future.done and sums and len(heard) == 4)
    _spin(bus)
    assert heard == ["", "abcd", "abcdabcd", "abcdabcdabcd"]
    assert (future.result.sum, sums) == (7, [b"\0\1\0\0" + struct.pack("<q", 3)])
    assert (bus.trailing, dict(bus.refused)) == (4, {})
    said = [r.message for r in caplog.records if "24 bytes after a message" in r.message]
    assert sorted(words.partition(":")[0] for words in said) == ["/add", "/chatter", "/other"]


_READER = f"""
import sys, time, zenoh
from tests.bridge.wire.peer import raw_session
with raw_session(sys.argv[1]) as session:
    subscriber = session.declare_subscriber("{CHATTER}", lambda sample: None)
    print("ready", flush=True)
    time.sleep(60)
"""


def test_a_reader_that_stops_reading_neither_blocks_nor_grows_the_publisher(bus: Bus, endpoint: str) -> None:
    publisher = bus.create_node("talker").create_publisher(String, "chatter")
    with _process(_READER, endpoint) as reader:
        wait_for(lambda: publisher.has_subscribers)
        publisher.publish(String("x" * 100_000))
        reader.send_signal(signal.SIGSTOP)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in range(1000):
            publisher.publish(String("x" * 100_000))
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 60_000  # [KiB] of 100 MB
        reader.kill()


TOKENS = (
    "@ros2_lv/0/a/0/0/NN/%/%",  # too short
    "@ros2_lv/0/a/0/1/XX/%/%/n/%t/std_msgs::msg::dds_::String_/h/::,10:,:,:,,",
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/std_msgs::msg::dds_::String_/h",  # no QoS
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/std_msgs::msg::dds_::String_/h/9:,:",
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/std_msgs::msg::dds_::String_/h/9::,10:,:,:,,",  # no such reliability
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/std_msgs::msg::dds_::String_/h/::,ten:,:,:,,",
    "@ros2_lv/0/a/0/0/NN/%/%/" + "n" * 10_000,
    "@/ab/@ros2_lv/MP/chatter/std_msgs§msg§String/x",
    "@/ab/@ros2_lv/ZZ/chatter/std_msgs§msg§String",
)


def test_unreadable_tokens_are_counted_and_others_are_seen(
    bus: Bus, endpoint: str, caplog: pytest.LogCaptureFixture
) -> None:
    graph = Graph.watch(bus)
    with raw_session(endpoint) as peer:
        good = "@ros2_lv/0/a/0/0/NN/%/%/good_node"
        kept = [peer.liveliness().declare_token(token) for token in (*TOKENS, good)]
        wait_for(lambda: [node.name for node in graph.nodes] == ["good_node"])
        wait_for(lambda: bus.refused["token"] == len(TOKENS))
        _spin(bus)
        reports = [r.message for r in caplog.records if "token" in r.message]
        assert 0 < len(reports) <= len(TOKENS)
        assert max(map(len, reports)) < 300
        del kept
    graph.close()


def test_names_of_others_fill_no_memory(caplog: pytest.LogCaptureFixture) -> None:
    queue = ExternalQueue(depth=10)
    for number in range(5000):
        queue.refuse("type", f"/{number}" + "x" * 10_000, "unknown")
    queue.report()
    assert queue.refused["type"] == 5000
    assert len(caplog.records) == 1000


_FORK = """
import os, sys
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED
bus = Bus.open(Clock(), listen=[sys.argv[1]])
node = bus.create_node("a")
node.create_subscription(String, "x", print, LATCHED)
child = os.fork()
if child == 0:
    sys.exit(7)
_, status = os.waitpid(child, 0)
sys.exit(os.waitstatus_to_exitcode(status))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_ends_without_the_bus(endpoint: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _FORK, endpoint], timeout=120, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (7, "", "")


def test_a_request_without_numbers_of_ros_is_answered_once(bus: Bus, endpoint: str) -> None:
    """Two equal requests, as of a script that numbers none: each has its own answer."""
    bus.create_node("adder").create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
    with raw_session(endpoint) as peer:
        sums: list[int] = []
        wait_for(lambda: list(peer.liveliness().get("@ros2_lv/0/*/*/*/SS/**")))
        for a in (1, 2):
            peer.get(
                "add",
                lambda reply: sums.append(struct.unpack("<q", reply.ok.payload.to_bytes()[4:])[0]),
                payload=b"\0\1\0\0" + struct.pack("<qq", a, 0),
            )
        wait_for(lambda: _spin(bus) and len(sums) == 2)
        assert sorted(sums) == [1, 2]


@pytest.mark.parametrize(("left", "counted"), [(0, 0), (3, 0), (4, 1)])
def test_what_fills_the_last_word_of_a_message_does_not_follow_it(left: int, counted: int) -> None:
    queue, strings = ExternalQueue(depth=1), codec(String)
    message = read(queue, "/a", strings, strings.encode(String("abc")) + bytes(left))
    assert (message, queue.trailing, dict(queue.refused)) == (String("abc"), counted, {})
