"""Others read our bags, and we theirs."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bridge.bags import helpers as bags
from twin.bridge import types
from twin.bridge.bags.convert import convert
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.topic_choice import TopicChoice
from twin.bridge.bags.writer import BagWriter
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import JointState, new
from twin.errors import RecordingError

ALL = 2 * bags.COUNT + 1


def plain(message: Any) -> Any:
    """Return a message of any library as plain data."""
    if isinstance(message, (str, int, float, bool, bytes)):
        return message
    if isinstance(message, (list, tuple, np.ndarray)):
        return [plain(item) for item in message]
    if hasattr(message, "tolist"):
        return message.tolist()
    names = list(getattr(message, "__slots__", None) or vars(message))
    return {name: plain(getattr(message, name)) for name in names if not name.startswith("_")}


@pytest.mark.parametrize("compression", ["none", "zstd", "lz4"])
def test_mcap_ros2_decodes_our_bags(tmp_path: Path, compression: str) -> None:
    pytest.importorskip("mcap_ros2", reason="mcap-ros2-support is not installed")
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    file = bags.make_bag(tmp_path / "bag", compression=compression) / "bag_0.mcap"
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        got = [(c.topic, m.log_time, plain(ros)) for _, c, m, ros in reader.iter_decoded_messages()]
    assert got == [(topic, time, plain(message)) for topic, message, time in bags.messages()]


def test_the_library_of_mcap_finds_nothing_wrong(tmp_path: Path) -> None:
    mcap_reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    file = bags.make_bag(tmp_path / "bag", compression="zstd") / "bag_0.mcap"
    with file.open("rb") as stream:
        reader = mcap_reader.make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        assert reader.get_header().library.startswith("twin ")
        summary = reader.get_summary()
        assert summary.statistics.message_count == ALL
        channel = next(c for c in summary.channels.values() if c.topic == "/scan")
        assert (channel.message_encoding, summary.schemas[channel.schema_id].encoding) == ("cdr", "ros2msg")
        assert channel.metadata["topic_type_hash"].startswith("RIHS01_64c1913980")
        assert channel.metadata["offered_qos_profiles"].startswith("- history: keep_last\n  depth: 5\n")
        assert len(list(reader.iter_messages(topics=["/scan"]))) == bags.COUNT
        window = reader.iter_messages(starting_at=bags.PERIOD_NS, ending_before=2 * bags.PERIOD_NS)
        assert len(list(window)) == 2
        assert {record.name for record in reader.iter_metadata()} == {"rosbag2"}


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_rosbags_reads_our_bags(tmp_path: Path, storage: str) -> None:
    from rosbags.highlevel import AnyReader

    path = bags.make_bag(tmp_path / "bag", storage=storage)
    with AnyReader([path]) as reader:  # also compares the types' hashes with the definitions
        got = [(c.topic, t, bytes(data)) for c, t, data in reader.messages()]
        assert got == [(t, ns, codec(type(m)).encode(m)) for t, m, ns in bags.messages()]
        scan = next(c for c in reader.connections if c.topic == "/scan")
        assert scan.ext.offered_qos_profiles[0].depth == 5


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
@pytest.mark.parametrize("mode", ["NONE", "FILE", "MESSAGE"])
def test_we_read_what_rosbags_writes(tmp_path: Path, storage: str, mode: str) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.rosbag2.enums import CompressionFormat, CompressionMode

    path = tmp_path / "theirs"
    writer = Writer(path, version=8, storage_plugin=StoragePlugin[storage])
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        connections = {
            name: writer.add_connection(name, cls.__msgtype__, typestore=types.store)
            for name, (cls, _) in bags.TOPICS.items()
        }
        for topic, message, time in bags.messages():
            writer.write(connections[topic], time, codec(type(message)).encode(message))
    with BagReader(path) as bag:
        got = list(bag.messages())
        assert [m.data for m in got] == [codec(type(m)).encode(m) for _, m, _ in bags.messages()]
        assert bag.info.count == ALL
        assert bag.topics["/scan"].definition


def test_a_ros1_bag_becomes_ros2_and_back(tmp_path: Path) -> None:
    source = bags.make_bag(tmp_path / "bag")
    done = convert(source, tmp_path / "one.bag", storage="rosbag1")
    assert (done.messages, done.topics, done.notices) == (ALL, 3, ())
    back = convert(tmp_path / "one.bag", tmp_path / "back")
    assert (back.messages, back.notices) == (ALL, ())
    with BagReader(source) as before, BagReader(tmp_path / "back") as after:
        # A ROS 1 bag does not keep the order of messages of one time.
        assert sorted(m[:3] for m in before.messages()) == sorted(m[:3] for m in after.messages())
        assert after.topics["/tf_static"].latched
        assert {n: t.type_hash for n, t in before.topics.items()} == {
            n: t.type_hash for n, t in after.topics.items()
        }


@pytest.mark.parametrize("name", ["sensor_msgs/msg/JointState", "std_msgs/msg/Header"])
def test_bytes_after_messages_are_left_out_of_a_ros1_bag_and_counted(tmp_path: Path, name: str) -> None:
    """As in bags that are written with rosbag2_py; Header is a type that has other fields in ROS 1."""
    cls = types.get(name)
    exact = codec(cls).encode(new(cls))
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic(BagTopic(name="/odd", type=name))
        for time, rest in enumerate((b"", b"\xa5" * 8, b"\xa5" * 24)):
            writer.write(BagMessage("/odd", exact + rest, time, time, time))
    done = convert(tmp_path / "bag", tmp_path / "one.bag", storage="rosbag1")
    assert done.messages == 3
    assert [words.partition(": ")[2] for words in done.notices] == [
        "messages on /odd with bytes after their end, which are left out: 2"
    ]
    with BagReader(tmp_path / "one.bag") as bag:
        assert [m.data for m in bag.messages()] == [exact] * 3
    convert(tmp_path / "bag", tmp_path / "sqlite", storage="sqlite3")
    with BagReader(tmp_path / "sqlite") as bag:
        assert [len(m.data) - len(exact) for m in bag.messages()] == [0, 8, 24]  # nothing is encoded again


def test_a_message_that_is_cut_off_is_no_ros1_message(tmp_path: Path) -> None:
    exact = codec(JointState).encode(new(JointState, name=["wheel"]))
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic(BagTopic(name="/odd", type=JointState.__msgtype__))
        writer.write(BagMessage("/odd", exact[:-9], 5, 5, 1))
    with pytest.raises(RecordingError, match="message on /odd at 5 ns is not a sensor_msgs/msg/JointState"):
        convert(tmp_path / "bag", tmp_path / "one.bag", storage="rosbag1")
    assert not (tmp_path / "one.bag").exists()


def test_ros1_types_are_brought_to_ros2(tmp_path: Path) -> None:
    """Fields that moved (Header's seq, CameraInfo's K) and types that only the bag knows."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    own = "Header header\ntime when\nodd_msgs/Part[] parts\n"
    store.register(get_types_from_msg(own, "odd_msgs/msg/Odd"))
    store.register(get_types_from_msg("string name\nint8 n\n", "odd_msgs/msg/Part"))
    types1 = store.types
    time1, header1 = types1["builtin_interfaces/msg/Time"], types1["std_msgs/msg/Header"]
    odd = types1["odd_msgs/msg/Odd"](
        header1(7, time1(1, 2), "map"), time1(3, 4), [types1["odd_msgs/msg/Part"]("a", -1)]
    )
    region = types1["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    camera = types1["sensor_msgs/msg/CameraInfo"](
        header1(8, time1(5, 6), "cam"), 480, 640, "plumb_bob", np.zeros(5), np.arange(9.0), np.zeros(9),
        np.zeros(12), 0, 0, region,
    )  # fmt: skip
    with Writer(tmp_path / "odd.bag") as writer:
        for topic, message in (("/odd", odd), ("/camera_info", camera)):
            connection = writer.add_connection(topic, message.__msgtype__, typestore=store, latching=1)
            writer.write(connection, 10, store.serialize_ros1(message, message.__msgtype__))

    with BagReader(tmp_path / "odd.bag") as bag:
        assert bag.notices == ()
        got = {m.topic: codec(types.get(bag.topics[m.topic].type)).decode(m.data) for m in bag.messages()}
        assert bag.topics["/odd"].latched
    assert plain(got["/odd"]) == {
        "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"},
        "when": {"sec": 3, "nanosec": 4},
        "parts": [{"name": "a", "n": -1}],
    }
    assert got["/camera_info"].k.tolist() == list(range(9))
    assert got["/camera_info"].header.frame_id == "cam"


def test_debians_rosbag_reads_what_convert_writes(tmp_path: Path) -> None:
    tool = shutil.which("rosbag")
    if tool is None:
        pytest.skip("Debian's python3-rosbag and rosbag are not installed")
    convert(
        bags.make_bag(tmp_path / "bag", start_ns=1_700_000_000 * 10**9), tmp_path / "a.bag", storage="rosbag1"
    )
    done = subprocess.run(
        [tool, "info", "--yaml", str(tmp_path / "a.bag")],
        capture_output=True, text=True, check=False, timeout=120, env={"PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    import yaml

    info = yaml.safe_load(done.stdout)
    assert (info["messages"], info["indexed"], info["compression"]) == (ALL, True, "none")
    assert {t["topic"]: (t["type"], t["messages"]) for t in info["topics"]} == {
        "/chatter": ("std_msgs/String", bags.COUNT),
        "/scan": ("sensor_msgs/LaserScan", bags.COUNT),
        "/tf_static": ("tf2_msgs/TFMessage", 1),
    }
    # The published sums of Noetic.
    assert {t["type"]: t["md5"] for t in info["types"]} == {
        "sensor_msgs/LaserScan": "90c7ef2dc6895d81024acba2ac42f369",
        "std_msgs/String": "992ce8a1687cec8c8bd883ec73ca41d1",
        "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    }  # fmt: skip


def test_repairing_a_bag_that_was_cut_off(tmp_path: Path) -> None:
    whole = bags.make_bag(tmp_path / "bag")
    cut = tmp_path / "cut"
    cut.mkdir()
    data = (whole / "bag_0.mcap").read_bytes()
    (cut / "bag_0.mcap").write_bytes(data[: len(data) // 2])
    done = convert(cut, tmp_path / "repaired", compression="zstd")
    assert 0 < done.messages < ALL
    assert len(done.notices) == 2
    with BagReader(tmp_path / "repaired") as bag:
        assert bag.notices == ()
        assert bag.info.count == done.messages


def test_only_some_topics_are_converted(tmp_path: Path) -> None:
    source = bags.make_bag(tmp_path / "bag")
    assert (
        convert(source, tmp_path / "some", topics=TopicChoice(topics=("/scan",)), storage="sqlite3").messages
        == bags.COUNT
    )


def test_messages_of_unknown_types_are_kept_or_counted(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic(BagTopic(name="/odd", type="unheard_of_msgs/msg/Odd"))
        writer.write(BagMessage("/odd", b"\0\1\0\0\1", 5, 5))
    assert convert(tmp_path / "bag", tmp_path / "again", storage="sqlite3").messages == 1
    done = convert(tmp_path / "bag", tmp_path / "a.bag", storage="rosbag1")
    assert done.messages == 0
    assert "1 messages on /odd are left out: the type unheard_of_msgs/msg/Odd is not known" in done.notices[0]


def test_the_library_of_mcap_finds_old_messages_in_the_chunk_that_has_them(tmp_path: Path) -> None:
    """Readers leave out chunks by their start and end: those must hold for messages that came late too."""
    mcap_reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    times = [5, 3, 9, 600_000_000, 200, 900_000_000, 100]
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic(BagTopic(name="/scan", type="sensor_msgs/msg/LaserScan"))
        for time in times:
            writer.write(BagMessage("/scan", b"x" * 8, time, time))
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        reader = mcap_reader.make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert len(summary.chunk_indexes) > 1
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (
            3,
            900_000_000,
        )
        assert [m.log_time for _, _, m in reader.iter_messages()] == sorted(times)
        early = reader.iter_messages(ending_before=150)
        assert [m.log_time for _, _, m in early] == [3, 5, 9, 100]
        late = reader.iter_messages(starting_at=150)
        assert [m.log_time for _, _, m in late] == [200, 600_000_000, 900_000_000]
