"""`twin topic …` in a process of its own, about the topics of another one."""

from __future__ import annotations

import itertools
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import Mock

import pytest

from twin.bridge.tools.statistics import Bandwidth, Spread
from twin.cli.ros.topic.echo import EchoPrinter, EchoStyle
from twin.cli.ros.topic.measure import bandwidth_text, rate_hz, spread_text

Twin = Callable[..., "subprocess.CompletedProcess[str]"]

GRAPH = "topic_graph.py"
TWIST = "geometry_msgs.msg.Twist(linear=geometry_msgs.msg.Vector3(x={}, y=0.0, z=0.0), "
TWIST += "angular=geometry_msgs.msg.Vector3(x=0.0, y=0.0, z={}))"


@contextmanager
def started(endpoint: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run `twin …` until the end of the block; Ctrl-C ends it then, quietly."""
    command = [sys.executable, "-m", "twin.cli", *arguments, "--connect", endpoint]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            assert process.stderr is not None
            _, errors = process.communicate(timeout=120)
            assert (process.returncode, errors) == (0, "")
        finally:
            process.kill()


def lines(process: subprocess.Popen[str], count: int) -> list[str]:
    assert process.stdout is not None
    return [process.stdout.readline().rstrip("\n") for _ in range(count)]


def test_topics_are_listed_with_types(twin: Twin) -> None:
    done = twin("topic", "list", "-t")
    assert done.stderr == ""
    found = done.stdout.splitlines()
    assert found == sorted(found)
    assert {
        "/chatter [std_msgs/msg/String]",
        "/robot/cmd_vel [geometry_msgs/msg/Twist]",
        "/robot/gps [course_msgs/msg/Gps]",
    } <= set(found)
    assert not any("_" in name.replace("robot_description", "").partition("/_")[1] for name in found)


def test_topics_are_counted_and_hidden_ones_shown(twin: Twin) -> None:
    shown = twin("topic", "list").stdout.splitlines()
    every = twin("topic", "list", "--include-hidden-topics").stdout.splitlines()
    assert twin("topic", "list", "-c").stdout == f"{len(shown)}\n"
    assert set(every) - set(shown) == {
        "/_secret",
        "/fibonacci/_action/feedback",
        "/fibonacci/_action/status",
    }


def test_a_verbose_list_counts_publishers_and_subscribers(twin: Twin) -> None:
    published, _, subscribed = twin("topic", "list", "-v").stdout.partition("\n\n")
    assert published.startswith("Published topics:\n * /chatter [std_msgs/msg/String] 1 publisher\n")
    assert " * /robot/mixed [std_msgs/msg/String] 2 publishers" in published
    assert subscribed.startswith("Subscribed topics:\n")
    assert " * /robot/cmd_vel [geometry_msgs/msg/Twist] 1 subscriber\n" in subscribed
    assert "mixed" not in subscribed


def test_info(twin: Twin) -> None:
    brief = "Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 0\n"
    assert twin("topic", "info", "/robot_description").stdout == brief
    verbose = twin("topic", "info", "-v", "/robot_description").stdout
    gid = re.search(r"^GID: (.*)$", verbose, re.MULTILINE)
    assert gid
    assert re.fullmatch(r"([0-9a-f]{2}\.){15}[0-9a-f]{2}", gid[1])
    assert verbose == (
        "Type: std_msgs/msg/String\n\n"
        "Publisher count: 1\n\n"
        "Node name: talker\n"
        "Node namespace: /\n"
        "Topic type: std_msgs/msg/String\n"
        "Topic type hash: RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18\n"
        "Endpoint type: PUBLISHER\n"
        f"GID: {gid[1]}\n"
        "QoS profile:\n"
        "  Reliability: RELIABLE\n"
        "  History (Depth): KEEP_LAST (1)\n"
        "  Durability: TRANSIENT_LOCAL\n"
        "  Lifespan: Infinite\n"
        "  Deadline: Infinite\n"
        "  Liveliness: AUTOMATIC\n"
        "  Liveliness lease duration: Infinite\n\n"
        "Subscription count: 0\n\n"
    )


def test_info_tells_every_promise(twin: Twin) -> None:
    assert (
        "  Reliability: RELIABLE\n"
        "  History (Depth): KEEP_ALL\n"
        "  Durability: VOLATILE\n"
        "  Lifespan: 3000000000 nanoseconds\n"
        "  Deadline: 200000000 nanoseconds\n"
        "  Liveliness: MANUAL_BY_TOPIC\n"
        "  Liveliness lease duration: 1000000001 nanoseconds\n"
    ) in twin("topic", "info", "-v", "/robot/promised").stdout


def test_types_and_topics_of_a_type(twin: Twin) -> None:
    assert twin("topic", "type", "/robot/cmd_vel").stdout == "geometry_msgs/msg/Twist\n"
    assert twin("topic", "find", "geometry_msgs/msg/Twist").stdout == "/robot/cmd_vel\n/robot/heard\n"
    assert twin("topic", "find", "-c", "sensor_msgs/LaserScan").stdout == "1\n"


@pytest.mark.parametrize("verb", ["info", "type"])
def test_an_unknown_topic_is_told_with_the_nearest_one(twin: Twin, verb: str) -> None:
    done = twin("topic", verb, "/robot/cmdvel")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(
        "error: Unknown topic '/robot/cmdvel'; did you mean '/robot/cmd_vel'? Valid: /"
    )


def test_echo_once_prints_one_of_those_that_come_together(capsys: pytest.CaptureFixture[str]) -> None:
    style = EchoStyle(raw=True, no_lost=True)
    printer = EchoPrinter(Mock(), Mock(), style, None, once=True)
    for payload in (b"one", b"two"):
        printer.on_sample(Mock(payload=payload))
    assert capsys.readouterr().out == "b'one'\n---\n"
    assert printer.is_done


def test_echo_prints_what_was_latched_before(twin: Twin) -> None:
    done = twin("topic", "echo", "/robot_description", "--once")
    text = "<robot/>" * 30
    assert done.stdout == f"data: {text[:128]}...\n---\n"
    assert twin("topic", "echo", "/robot_description", "--once", "-f").stdout == f"data: {text}\n---\n"


def test_echo_ignores_bytes_after_a_message_and_counts_it(twin: Twin) -> None:
    done = twin("topic", "echo", "--once", "/padded")
    assert (done.returncode, done.stdout) == (0, "data: whole\n---\n")
    assert "/padded: 8 bytes after a message are ignored, as in ROS 2; reported once\n" in done.stderr
    assert "messages with bytes after their end, which were ignored: 1\n" in done.stderr


def test_echo_of_arrays(twin: Twin) -> None:
    cut = twin("topic", "echo", "/robot/scan", "--once", "-l", "2").stdout
    assert cut.endswith("ranges:\n- 0.0\n- 0.25\n- '...'\nintensities: []\n---\n")
    assert "ranges: '<sequence type: float, length: 200>'\n" in (
        twin("topic", "echo", "/robot/scan", "--once", "--no-arr").stdout
    )
    field = twin("topic", "echo", "/robot/scan", "--once", "--field", "ranges").stdout
    assert field.startswith("array('f', [0.0, 0.25, 0.5, ")
    assert field.endswith("49.75])\n---\n")


def test_echo_as_csv_with_message_info(twin: Twin) -> None:
    done = twin("topic", "echo", "/robot/point", "--once", "--csv", "-i")
    source, received, sequence, unused, seconds, _, frame, *rest = done.stdout.strip().split(",")
    assert 0 <= int(received) - int(source) < 10**10
    assert int(seconds) - int(source) // 10**9 in (-1, 0)
    assert int(sequence) > 0
    assert (unused, frame, rest) == ("0", "map", ["0.0", "0.0", "0.0"])


def test_echo_with_a_field_and_a_filter(twin: Twin) -> None:
    done = twin("topic", "echo", "/chatter", "--once", "--filter", "int(m.data.split(':')[1]) % 10 == 0")
    assert re.fullmatch(r"data: 'Hello World: \d*0'\n---\n", done.stdout)
    done = twin("topic", "echo", "/chatter", "--once", "--field", "data", "--filter", "m.startswith('Hello')")
    assert re.fullmatch(r"Hello World: \d+\n---\n", done.stdout)
    done = twin("topic", "echo", "/chatter", "--once", "--field", "dat")
    assert done.returncode == 2
    assert "Invalid field 'dat': std_msgs/msg/String has no field 'dat'; valid: data" in done.stderr


def test_echo_learns_an_unknown_type_from_its_publisher(twin: Twin) -> None:
    done = twin("topic", "echo", "/robot/gps", "--once")
    assert done.stdout == "name: gps\nx: 1.5\nposition:\n- 3.0\n- 4.0\n---\n", done.stderr
    raw = twin("topic", "echo", "/robot/gps", "--once", "--raw").stdout
    assert raw.startswith("b'\\x00\\x01\\x00\\x00\\x04\\x00\\x00\\x00gps\\x00")


def test_a_definition_that_differs_is_refused(twin: Twin, tmp_path: Path) -> None:
    folder = tmp_path / "course_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Gps.msg").write_text("string name\nfloat64 x\nfloat64 y\n")
    done = twin("topic", "echo", "/robot/gps", "--once", "--interfaces", str(tmp_path))
    assert done.returncode == 2
    assert "/robot/sensors has another definition of course_msgs/msg/Gps (RIHS01_" in done.stderr


def test_publishers_that_promise_different_things(twin: Twin) -> None:
    done = twin("topic", "echo", "/robot/mixed", "--timeout", "0.5")
    assert (done.returncode, done.stdout) == (0, "")
    assert "Some, but not all, publishers are offering QoSReliabilityPolicy.RELIABLE. Falling" in done.stderr


def test_echo_waits_for_a_topic(endpoint: str, twin: Twin) -> None:
    done = twin("topic", "echo", "/chater", "--timeout", "0.5")
    assert done.returncode == 2
    warning, error = done.stderr.splitlines()
    assert warning.startswith(
        "WARNING: topic [/chater] does not appear to be published yet; did you mean '/chatter'? Valid: /"
    )
    assert error == "error: Could not determine the type for the passed topic /chater"
    command = [sys.executable, "-m", "twin.cli", "topic", "echo", "/late", "--once", "--connect", endpoint]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as waiting:
        assert waiting.stderr is not None
        assert "topic [/late] does not appear to be published yet" in waiting.stderr.readline()
        published = twin("topic", "pub", "/late", "std_msgs/msg/String", "data: 5", "-r", "20", "-t", "20")
        assert published.returncode == 0
        assert waiting.communicate(timeout=120)[0] == "data: '5'\n---\n"


def test_a_reader_that_goes_away_is_no_error(endpoint: str) -> None:
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m twin.cli topic echo /chatter --connect {endpoint} | head -1"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert re.fullmatch(r"data: 'Hello World: \d+'\n", done.stdout)


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"\d+(?:\.\d+)?", text)]


def test_hz(endpoint: str) -> None:
    """How fast messages come is the machine's affair; rate and gaps are about the same ones."""
    with started(endpoint, "topic", "hz", "/chatter") as process:
        first, second = lines(process, 2)
    assert re.fullmatch(r"average rate: \d+\.\d{3}", first)
    assert re.fullmatch(r"\tmin: \d+\.\d{3}s max: \d+\.\d{3}s std dev: \d+\.\d{5}s window: \d+", second)
    low, high, deviation, window = numbers(second)
    assert low - 0.001 <= 1.0 / numbers(first)[0] <= high + 0.001
    assert deviation <= high - low + 0.001
    assert window >= 1


def test_bw(endpoint: str) -> None:
    began = time.monotonic()
    with started(endpoint, "topic", "bw", "/robot/scan") as process:
        subscribed, speed, sizes = lines(process, 3)
    took_s = time.monotonic() - began
    assert subscribed == "Subscribed to [/robot/scan]"
    found = re.fullmatch(r"(\d+(?:\.\d\d)?) (B|KB|MB)/s from (\d+) messages", speed)
    assert found
    unit = {"B": 1.0, "KB": 1e3, "MB": 1e6}[found[2]]
    mean, low, high = (size * unit for size in numbers(sizes))
    assert low == mean == high == pytest.approx(864, abs=0.005 * unit)
    assert float(found[1]) * unit > int(found[3]) * 800 / took_s


@pytest.mark.parametrize(
    ("bandwidth", "text"),
    [
        (Bandwidth(999.4, 2, 864.0, 863, 865), "999 B/s from 2 messages mean: 864 B min: 863 B max: 865 B"),
        (
            Bandwidth(17280.0, 40, 864.0, 100, 1234),
            "17.28 KB/s from 40 messages mean: 0.86 KB min: 0.10 KB max: 1.23 KB",
        ),
        (
            Bandwidth(2.5e6, 3, 1e6, 500_000, 1_500_000),
            "2.50 MB/s from 3 messages mean: 1.00 MB min: 0.50 MB max: 1.50 MB",
        ),
    ],
)
def test_bandwidth_has_the_unit_of_its_size(bandwidth: Bandwidth, text: str) -> None:
    assert bandwidth_text(bandwidth).replace("\n\tMessage size", "") == text


def test_rates_and_delays_are_in_seconds() -> None:
    spread = Spread(0.02e9, 0.01e9, 0.03e9, 1.5e6, 7)
    assert spread_text("average rate", rate_hz(spread), spread) == (
        "average rate: 50.000\n\tmin: 0.010s max: 0.030s std dev: 0.00150s window: 7"
    )


def test_delay(endpoint: str) -> None:
    """The stamps are 0.2 s old when they are published."""
    began = time.monotonic()
    with started(endpoint, "topic", "delay", "/robot/point") as process:
        first, second = lines(process, 2)
    took_s = time.monotonic() - began
    assert re.fullmatch(r"average delay: \d+\.\d{3}", first)
    assert re.fullmatch(r"\tmin: \d+\.\d{3}s max: \d+\.\d{3}s std dev: \d+\.\d{5}s window: \d+", second)
    low, high, *_ = numbers(second)
    assert 0.2 <= low <= numbers(first)[0] <= high < 0.2 + took_s


def test_delay_needs_a_header(twin: Twin) -> None:
    done = twin("topic", "delay", "/chatter")
    assert done.returncode == 2
    assert done.stderr == "error: msg does not have header: /chatter carries std_msgs/msg/String\n"


def test_pub_once_reaches_the_subscription(twin: Twin) -> None:
    values = "{linear: {x: 0.25}, angular: {z: -1}}"
    done = twin("topic", "pub", "--once", "/robot/cmd_vel", "geometry_msgs/msg/Twist", values)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"publisher: beginning loop\npublishing #1: {TWIST.format(0.25, -1.0)}\n\n"
    heard = twin("topic", "echo", "/robot/heard", "--once", "--field", "linear")
    assert heard.stdout == "x: 0.25\ny: 0.0\nz: 0.0\n---\n"


def test_pub_times_prints_every_nth_and_stamps(endpoint: str, twin: Twin) -> None:
    began = time.time()
    with started(endpoint, "topic", "echo", "/stamped", "geometry_msgs/msg/PointStamped", "--csv") as echo:
        done = twin(
            *("topic", "pub", "-t", "4", "-r", "20", "-p", "2", "/stamped", "geometry_msgs/msg/PointStamped"),
            "{header: auto, point: {x: 1}}",
        )
        stamps = [line.split(",") for line in lines(echo, 4)]
    assert re.findall(r"#\d", done.stdout) == ["#2", "#4"]
    times = [int(seconds) + int(nanoseconds) * 1e-9 for seconds, nanoseconds, *_ in stamps]
    assert all(before < after for before, after in itertools.pairwise([began, *times, time.time()]))


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("std_msgs/msg/String", "dat: 5"), "std_msgs/msg/String has no field 'dat'"),
        (("std_msgs/msg/Strin", "data: x"), "did you mean 'std_msgs/msg/String'?"),
        (("std_msgs/msg/String", "[1]"), "The passed value needs to be a dictionary in YAML format"),
        (("std_msgs/msg/String", "{data: ["), "is no YAML"),
        (
            ("std_msgs/msg/String", "data: x", "--once", "--max-wait-time-secs", "0.2"),
            "Timed out waiting for subscribers: Expected 1 subcribers but only got 0 subscribers",
        ),
    ],
)
def test_what_pub_refuses(twin: Twin, arguments: tuple[str, ...], sentence: str) -> None:
    done = twin("topic", "pub", "/nobody", *arguments)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr


def test_relay_passes_an_unknown_type_on(endpoint: str, twin: Twin) -> None:
    with started(endpoint, "topic", "relay", "/robot/gps", "/relayed") as process:
        assert lines(process, 1) == ["/robot/gps -> /relayed"]
        done = twin("topic", "echo", "/relayed", "--once", "--raw", "--timeout", "60")
        assert done.stdout.startswith("b'\\x00\\x01\\x00\\x00\\x04\\x00\\x00\\x00gps\\x00")
        assert "/relay\n" in twin("node", "list").stdout


def test_throttle_lets_fewer_pass(endpoint: str) -> None:
    """Of fifty in a second five: eight are published in more than a second, however slow the machine is."""
    with started(endpoint, "topic", "throttle", "messages", "/chatter", "5") as throttle:
        assert lines(throttle, 1) == ["/chatter -> /chatter_throttle"]
        with started(endpoint, "topic", "echo", "/chatter_throttle", "--csv", "-i") as echo:
            published = [int(line.split(",")[0]) for line in lines(echo, 8)]
    assert published[-1] - published[0] > 1e9
