"""`twin bag` in processes of its own, beside a talker."""

from __future__ import annotations

import os
import signal
import socket
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import pytest

from tests.bridge.bags import helpers as bags
from tests.processes import wait_for
from twin.bridge import live
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.writer import BagWriter
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import LaserScan, String
from twin.bridge.qos import LATCHED, QoS
from twin.cli.app import run_app

CLI = (sys.executable, "-m", "twin.cli", "bag")
ROOT = Path(__file__).parents[4]
PERIOD_NS = 10_000_000


class Talker:
    """A graph that says on /chatter what time it is, in a thread."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        self.heard: list[str] = []
        self._over = threading.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self._ready.wait(100)

    def _run(self) -> None:
        with live.join([], listen=[self.endpoint], domain_id=0) as process:
            node = process.bus.create_node("talker")
            node.create_publisher(String, "description", LATCHED).publish(String("<robot/>"))
            chatter = node.create_publisher(String, "chatter")
            node.create_timer(PERIOD_NS, lambda: chatter.publish(String(str(time.time_ns()))))
            node.create_subscription(String, "again", lambda m: self.heard.append(m.data), QoS(depth=1000))
            self._ready.set()
            process.spin(until=self._over.is_set)

    def close(self) -> None:
        self._over.set()
        self._thread.join(20)


@pytest.fixture(scope="module")
def talker() -> Iterator[Talker]:
    made = Talker()
    yield made
    made.close()


def twin_bag(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*CLI, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},  # of this checkout, wherever a test works
    )


def recording(talker: Talker, folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """Start a recorder, and wait until it has written something."""
    process = subprocess.Popen(
        [*CLI, "record", *arguments, "-o", str(folder), "--connect", talker.endpoint, "--domain", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for(lambda: any(map(holds_messages, [*folder.glob("*_0.mcap"), *folder.glob("*_0.db3")])))
    return process


def holds_messages(file: Path) -> bool:
    """Whether a file that is being written has messages on the disk; an empty database has 4 kB as well."""
    if file.suffix != ".db3":
        return file.stat().st_size > 4000
    with closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as database:
        try:
            return bool(database.execute("SELECT COUNT(*) FROM messages").fetchone()[0])
        except sqlite3.OperationalError:  # its tables are not there yet
            return False


def texts(path: Path) -> list[int]:
    with BagReader(path) as bag:
        return [int(codec(String).decode(m.data).data) for m in bag.messages(["/chatter"])]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recorder_ends_cleanly(talker: Talker, tmp_path: Path, number: signal.Signals) -> None:
    with recording(talker, tmp_path / "bag", "-a") as process:
        process.send_signal(number)
        out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert f"topics in {tmp_path / 'bag'}" in out
    with BagReader(tmp_path / "bag") as bag:
        assert bag.notices == ()
        assert bag.topics["/description"].count == 1
        assert bag.topics["/chatter"].count >= 20
    said = texts(tmp_path / "bag")
    assert said == sorted(said)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_killed_recorder_loses_at_most_the_last_second(
    talker: Talker, tmp_path: Path, storage: str
) -> None:
    with recording(talker, tmp_path / "bag", "chatter", "--storage", storage) as process:
        begun = time.time_ns()
        wait_for(lambda: time.time_ns() - begun > 800_000_000)
        killed = time.time_ns()
        os.kill(process.pid, signal.SIGKILL)
        process.wait(100)
    said = texts(tmp_path / "bag")
    assert killed - said[-1] < 1_000_000_000
    assert max(b - a for a, b in pairwise(said)) < 500_000_000  # nothing in between is lost
    done = twin_bag("convert", tmp_path / "bag", "-o", tmp_path / "repaired")
    assert done.returncode == 0
    assert "its recorder was stopped" in done.stderr
    assert len(texts(tmp_path / "repaired")) == len(said)


def test_a_bag_is_played_into_the_graph(talker: Talker, tmp_path: Path) -> None:
    path = bags.make_bag(tmp_path / "bag")
    talker.heard.clear()
    done = twin_bag(
        "play", path, "-r", 20, "-m", "/chatter:=/again", "--topics", "/chatter",
        "--connect", talker.endpoint, "--domain", "0",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    wait_for(lambda: len(talker.heard) == bags.COUNT)
    assert talker.heard == [f"Hello World: {number}" for number in range(bags.COUNT)]


def test_playing_is_ended_by_a_signal(talker: Talker, tmp_path: Path) -> None:
    path = bags.make_bag(tmp_path / "bag")
    talker.heard.clear()
    arguments = ["play", str(path), "--loop", "-m", "chatter:=again", "--connect", talker.endpoint]
    with subprocess.Popen([*CLI, *arguments, "--domain", "0"], stderr=subprocess.PIPE, text=True) as process:
        wait_for(lambda: len(talker.heard) > 3)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=120)
    assert (process.returncode, err) == (0, "")


def test_info_is_what_ros2_bag_info_prints(tmp_path: Path) -> None:
    path = bags.make_bag(tmp_path / "drive", start_ns=1_700_000_000 * 10**9)
    done = subprocess.run(
        [*CLI, "info", str(path)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "TZ": "UTC"},
    )
    assert (done.returncode, done.stderr) == (0, "")
    size = sum(file.stat().st_size for file in path.iterdir()) / 1024
    assert (
        done.stdout
        == f"""
Files:             drive_0.mcap
Bag size:          {size:.1f} KiB
Storage id:        mcap
ROS Distro:        jazzy
Duration:          2.900000001s
Start:             Nov 14 2023 22:13:20.000000000 (1700000000.000000000)
End:               Nov 14 2023 22:13:22.900000001 (1700000002.900000001)
Messages:          61
Topic information: Topic: /chatter | Type: std_msgs/msg/String | Count: 30 | Serialization Format: cdr
                   Topic: /scan | Type: sensor_msgs/msg/LaserScan | Count: 30 | Serialization Format: cdr
                   Topic: /tf_static | Type: tf2_msgs/msg/TFMessage | Count: 1 | Serialization Format: cdr
Service:           0
Service information:
"""
    )


def run_here(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *arguments: object) -> str:
    """Return what a command prints, run in this process."""
    monkeypatch.setattr(sys, "argv", ["twin", "bag", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        run_app()
    assert end.value.code == 0
    return capfd.readouterr().out


def test_convert_takes_the_storage_from_the_name(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = bags.make_bag(tmp_path / "drive"), tmp_path / "drive.bag"
    options = ("--compression", "lz4", "--topics", "/scan")
    out = run_here(capfd, monkeypatch, "convert", source, "-o", target, *options)
    assert out == f"30 messages on 1 topics in {target}\n"
    out = run_here(capfd, monkeypatch, "info", target)
    assert "Storage id:        rosbag1" in out
    assert "Topic: /scan | Type: sensor_msgs/msg/LaserScan | Count: 30" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["info", "nowhere"], "nowhere: cannot be read: No such file or directory"),
        (["record"], ""),
        (["record", "-x", "a"], "name topics, or give --all or --regex"),
        (["record", "-a", "--storage", "mcup"], "'mcup' is no storage of bags; did you mean 'mcap'"),
        (["record", "-a", "--connect", "tcp/127.0.0.1:1"], "tcp/127.0.0.1:1"),
        (["convert", "bag", "-o", "x", "--compression", "gz"], "'gz' is no compression"),
        (["convert", "bag", "-o", "bag"], "bag exists already; name another bag, or remove it"),
        (["convert", "bag", "-o", "x.bag", "--compression", "zstd"], "cannot be compressed with zstd"),
        (["convert", "bag", "-o", "x", "--topics", "/scam"], "there is no topic /scam; did you mean '/scan'"),
        (["play", "bag", "--remap", "a=b"], "must be OLD:=NEW"),
        (["play", "bag", "--start-offset", "-1"], "must be a number of seconds, not less than 0"),
    ],
)
def test_mistakes_are_told(
    tmp_path: Path,
    arguments: list[str],
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    bags.make_bag(tmp_path / "bag")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    monkeypatch.setattr(sys, "argv", ["twin", "bag", *arguments])
    with pytest.raises(SystemExit) as end:
        run_app()
    printed = "".join(capfd.readouterr())
    assert end.value.code == 2
    assert words in printed
    assert "Traceback" not in printed


NODES = """
from twin.bridge.msgs import LaserScan, String

def nearest(bus):
    node = bus.create_node("nearest")
    bound = node.declare_parameter("bound", 3.0).value
    publisher = node.create_publisher(String, "nearest")
    node.create_subscription(
        LaserScan, "scan", lambda m: publisher.publish(String(f"{max(bound, m.ranges.min()):.2f}"))
    )
    return node
"""


@pytest.fixture
def lidar_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag as recorded from outside: scans, and what somebody published about them a moment later."""
    path, qos = tmp_path / "lidar", (OfferedQoS.of(QoS()),)
    with BagWriter(path) as writer:
        writer.add_topic(BagTopic(name="/scan", type="sensor_msgs/msg/LaserScan", qos=qos))
        writer.add_topic(BagTopic(name="/nearest", type="std_msgs/msg/String", qos=qos))
        for number in range(1, 25):
            at, answer = number * 10**8, String(f"{max(3.0, number):.2f}")
            writer.write(BagMessage("/scan", codec(LaserScan).encode(bags.scan(number)), at, at, number))
            writer.write(BagMessage("/nearest", codec(String).encode(answer), at + 99, at + 77, number))
    (tmp_path / "nodes.py").write_text(NODES)
    (tmp_path / "far.yaml").write_text("nearest: {ros__parameters: {bound: 5.0}}")
    monkeypatch.chdir(tmp_path)
    return path


def test_nodes_say_the_same_again(lidar_bag: Path) -> None:
    done = twin_bag("rerun", lidar_bag, "nodes.py:nearest")
    assert (done.returncode, done.stdout, done.stderr) == (0, "24 of 24 messages identical\n", "")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--outputs", "/nearest", "--topics", "/scan"], 0, "24 of 24 messages identical"),
        (["--params-file", "far.yaml"], 1, "message 0 of 24, /nearest, differs: the payload"),
        (["--outputs", "/near"], 2, "has no topic /near; did you mean '/nearest'"),
        (["--outputs", "/scan"], 1, "0 messages instead of 24"),
    ],
)
def test_rerun_with_options(
    lidar_bag: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    words: str,
) -> None:
    monkeypatch.setattr(sys, "argv", ["twin", "bag", "rerun", "lidar", "nodes.py:nearest", *arguments])
    with pytest.raises(SystemExit) as end:
        run_app()
    printed = " ".join("".join(capfd.readouterr()).split())
    assert end.value.code == code, printed
    assert words in printed


def test_rerun_of_nodes_that_took_no_part(lidar_bag: Path) -> None:
    Path("nodes.py").write_text(NODES.replace('"nearest")', '"other")'))
    done = twin_bag("rerun", lidar_bag, "nodes.py:nearest")
    assert done.returncode == 2
    assert "has nothing that the nodes of nodes.py:nearest had published" in " ".join(done.stderr.split())
