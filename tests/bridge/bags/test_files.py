from __future__ import annotations

import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

from tests.bridge.bags import helpers as bags
from twin.bridge.bags.convert import Target, convert
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import LaserScan
from twin.errors import RecordingError

ALL = 2 * bags.COUNT + 1
KINDS = [
    {"storage": "mcap"},
    {"storage": "mcap", "compression": "zstd"},
    {"storage": "mcap", "compression": "lz4"},
    {"storage": "sqlite3"},
    {"storage": "sqlite3", "compression": "zstd"},
]


def read(path: Path) -> list[BagMessage]:
    with BagReader(path) as bag:
        assert bag.notices == ()
        return list(bag.messages())


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: "-".join(kind.values()))
def test_what_is_written_is_read(tmp_path: Path, kind: dict[str, str]) -> None:
    path = bags.make_bag(tmp_path / "bag", **kind)
    got = read(path)
    assert [(m.topic, m.log_ns, m.publish_ns) for m in got] == [(t, ns, ns) for t, _, ns in bags.messages()]
    assert [m.data for m in got] == [codec(type(m)).encode(m) for _, m, _ in bags.messages()]
    with BagReader(path) as bag:
        assert (bag.info.storage, bag.info.ros_distro, bag.info.count) == (kind["storage"], "jazzy", ALL)
        assert (bag.info.start_ns, bag.info.end_ns) == (0, (bags.COUNT - 1) * bags.PERIOD_NS + 1)
        assert {name: topic.count for name, topic in bag.topics.items()} == {
            "/scan": bags.COUNT,
            "/chatter": bags.COUNT,
            "/tf_static": 1,
        }
        (offered,) = bag.topics["/scan"].qos
        assert (offered.depth, offered.reliability, offered.durability) == (5, "best_effort", "volatile")
        assert bag.topics["/tf_static"].latched
        assert bag.topics["/scan"].type_hash.startswith("RIHS01_64c191398013af96509d518dac71d516")
        assert "MSG: builtin_interfaces/Time" in bag.topics["/scan"].definition


def test_a_window_and_topics_are_chosen(tmp_path: Path) -> None:
    path = bags.make_bag(tmp_path / "bag")
    with BagReader(path) as bag:
        window = list(bag.messages(["/scan"], 10 * bags.PERIOD_NS, 12 * bags.PERIOD_NS))
        assert [m.log_ns // bags.PERIOD_NS for m in window] == [10, 11, 12]
        with pytest.raises(RecordingError, match="has no topic /scam; did you mean '/scan'"):
            list(bag.messages(["/scam"]))


def test_the_same_messages_are_the_same_bytes(tmp_path: Path) -> None:
    one, two = (bags.make_bag(tmp_path / n / "bag") for n in ("one", "two"))
    for name in ("bag_0.mcap", "metadata.yaml"):
        assert (one / name).read_bytes() == (two / name).read_bytes()


def test_metadata_has_the_keys_of_rosbag2(tmp_path: Path) -> None:
    text = (bags.make_bag(tmp_path / "bag") / "metadata.yaml").read_text("utf-8")
    root = yaml.safe_load(text)["rosbag2_bagfile_information"]
    # As in bags recorded by ros2 bag of Jazzy, in its order.
    assert list(root) == [
        "version", "storage_identifier", "duration", "starting_time", "message_count",
        "topics_with_message_count", "compression_format", "compression_mode", "relative_file_paths",
        "files", "custom_data", "ros_distro",
    ]  # fmt: skip
    assert (root["version"], root["storage_identifier"], root["message_count"]) == (9, "mcap", ALL)
    topic = root["topics_with_message_count"][0]
    assert list(topic) == ["topic_metadata", "message_count"]
    assert list(topic["topic_metadata"]) == [
        "name", "type", "serialization_format", "offered_qos_profiles", "type_description_hash",
    ]  # fmt: skip
    (qos,) = topic["topic_metadata"]["offered_qos_profiles"]
    assert list(qos) == [
        "history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness",
        "liveliness_lease_duration", "avoid_ros_namespace_conventions",
    ]  # fmt: skip
    assert qos["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    assert list(root["files"][0]) == ["path", "starting_time", "duration", "message_count"]


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_a_bag_cut_anywhere_is_read_to_the_last_whole_chunk(tmp_path: Path, compression: str) -> None:
    whole = bags.make_bag(tmp_path / "bag", compression=compression) / "bag_0.mcap"
    data = whole.read_bytes()
    want = read(whole)
    counts = []
    for size in [*range(60, len(data), len(data) // 150), len(data) - 1]:
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(data[:size])
        with BagReader(cut) as bag:
            (notice,) = bag.notices
            assert "ends" in notice
            got = list(bag.messages())
            assert got == want[: len(got)]
            assert bag.info.count == len(got)
            counts.append(len(got))
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == ALL
    # Chunks of half a second: at most 5 scans, 5 texts and the static transforms are in work.
    assert max(b - a for a, b in pairwise(counts)) <= 11


def test_what_was_flushed_survives(tmp_path: Path) -> None:
    for storage in ("mcap", "sqlite3"):
        writer = BagWriter(tmp_path / storage, BagConfig(storage=storage))  # type: ignore[arg-type]
        bags.fill(writer)
        writer.flush()
        shutil.copytree(tmp_path / storage, tmp_path / f"killed_{storage}")
        with BagReader(tmp_path / f"killed_{storage}") as bag:
            assert bag.info.count == ALL
            assert "has no metadata.yaml, its recorder was stopped" in bag.notices[0]
        writer.close()


def test_messages_out_of_order_are_sorted(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic(BagTopic(name="/scan", type="sensor_msgs/msg/LaserScan"))
        for time in (5, 3, 4, 900_000_000, 7, 600_000_000):
            writer.write(BagMessage("/scan", b"x" * 8, time, time))
    assert [m.log_ns for m in read(tmp_path / "bag")] == [3, 4, 5, 7, 600_000_000, 900_000_000]


def test_an_empty_bag_is_a_bag(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag"):
        pass
    with BagReader(tmp_path / "bag") as bag:
        assert (bag.info.count, bag.info.duration_ns, bag.notices, bag.topics) == (0, 0, (), {})


def test_a_damaged_chunk_is_named(tmp_path: Path) -> None:
    file = bags.make_bag(tmp_path / "bag") / "bag_0.mcap"
    data = bytearray(file.read_bytes())
    data[2000] ^= 0xFF
    file.write_bytes(data)
    with BagReader(file) as bag, pytest.raises(RecordingError, match=r"the chunk at byte \d+ is damaged"):
        list(bag.messages())


def test_split_files_follow_one_another(tmp_path: Path) -> None:
    one = bags.make_bag(tmp_path / "one")
    two = bags.make_bag(tmp_path / "two", start_ns=10 * 1_000_000_000)
    root = yaml.safe_load((one / "metadata.yaml").read_text("utf-8"))
    shutil.copy(two / "two_0.mcap", one / "one_1.mcap")
    root["rosbag2_bagfile_information"]["relative_file_paths"].append("one_1.mcap")
    (one / "metadata.yaml").write_text(yaml.safe_dump(root), encoding="utf-8")
    with BagReader(one) as bag:
        got = list(bag.messages())
        assert bag.info.count == len(got) == 2 * ALL
        assert [m.log_ns for m in got] == sorted(m.log_ns for m in got)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: p, "No such file"),
        (lambda p: p.write_bytes(b""), "is empty"),
        (lambda p: p.write_bytes(b"hello, this is no bag at all"), "is not a bag; valid: a folder with"),
        (lambda p: p.mkdir(), "is not a bag; valid: a folder with metadata.yaml"),
        (lambda p: p.write_bytes(b"#ROSBAG V2.0\nnonsense"), "cannot be read as a ROS 1 bag"),
        (lambda p: p.write_bytes(b"SQLite format 3\0nonsense"), "cannot be read as a ROS 2 bag"),
        (lambda p: _folder(p, "hello"), "is not the metadata of a ROS 2 bag"),
        (lambda p: _folder(p, "a: [b"), "is not YAML"),
        (lambda p: _folder(p, METADATA.format(storage="mcap", files="[a.mcap]")), "a.mcap is missing"),
        (lambda p: _folder(p, METADATA.format(storage="x", files="[thing]")), "is missing"),
    ],
)  # fmt: skip
def test_what_is_no_bag_is_told_in_one_sentence(tmp_path: Path, make: object, words: str) -> None:
    path = tmp_path / "thing"
    make(path)  # type: ignore[operator]
    with pytest.raises(RecordingError, match=words) as fault:
        BagReader(path)
    assert str(path) in str(fault.value)
    assert "\n" not in str(fault.value)


METADATA = """rosbag2_bagfile_information:
  version: 9
  storage_identifier: {storage}
  relative_file_paths: {files}
  starting_time: {{nanoseconds_since_epoch: 0}}
  duration: {{nanoseconds: 0}}
  topics_with_message_count: []
"""


def _folder(path: Path, text: str) -> None:
    path.mkdir()
    (path / "metadata.yaml").write_text(text, encoding="utf-8")


def test_a_bag_is_not_overwritten(tmp_path: Path) -> None:
    path = bags.make_bag(tmp_path / "bag")
    with pytest.raises(RecordingError, match="exists already"):
        BagWriter(path)
    assert len(read(path)) == ALL


def test_a_full_disk_leaves_a_bag_that_can_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = BagWriter(tmp_path / "bag")
    bags.fill(writer)
    storage = writer._storage._output  # type: ignore[attr-defined]

    class Full:
        def __init__(self, file: object) -> None:
            self._file = file

        def write(self, data: memoryview) -> int:
            self._file.write(data[:100])  # type: ignore[attr-defined]
            raise OSError(28, "No space left on device")

        def __getattr__(self, name: str) -> object:
            return getattr(self._file, name)

    before = storage.size
    storage._file = Full(storage._file)
    with pytest.raises(RecordingError, match="No space left on device"):
        writer.close()
    assert storage._file.closed
    assert (tmp_path / "bag" / "bag_0.mcap").stat().st_size == before
    with BagReader(tmp_path / "bag") as bag:
        assert 0 < len(list(bag.messages())) < ALL


@pytest.mark.parametrize("target", ["copy", "copy.bag"])
def test_a_conversion_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str
) -> None:
    """What is left would be in the way of the next attempt."""
    source = bags.make_bag(tmp_path / "bag")
    read_on = BagReader.messages

    def interrupted(self: BagReader, topics: set[str]) -> Iterator[BagMessage]:
        yield next(read_on(self, topics))
        raise KeyboardInterrupt

    storage: Target = "rosbag1" if target.endswith(".bag") else "mcap"
    with monkeypatch.context() as patch:
        patch.setattr(BagReader, "messages", interrupted)
        with pytest.raises(KeyboardInterrupt):
            convert(source, tmp_path / target, storage=storage)
    assert not (tmp_path / target).exists()
    assert convert(source, tmp_path / target, storage=storage).messages == ALL
    with pytest.raises(RecordingError, match="exists already"):
        convert(source, tmp_path / target, storage=storage)
    assert (tmp_path / target).exists()


def test_types_come_with_the_bag(tmp_path: Path) -> None:
    from twin.bridge import types
    from twin.bridge.bags import definitions

    text = (
        "bag_test_msgs/Inner[2] pair\nstd_msgs/Header header\n"
        + "=" * 80
        + "\nMSG: bag_test_msgs/Inner\nfloat64 x\n"
    )
    definitions.learn("bag_test_msgs/msg/Outer", text)
    outer, inner = types.get("bag_test_msgs/msg/Outer"), types.get("bag_test_msgs/msg/Inner")
    message = outer(pair=[inner(1.0), inner(2.0)], header=bags.header(5, "a"))
    assert codec(outer).decode(codec(outer).encode(message)).pair[1].x == 2.0
    assert definitions.definition("bag_test_msgs/msg/Outer").startswith("bag_test_msgs/Inner[2] pair\n")


def test_a_scan_is_a_scan_again(tmp_path: Path) -> None:
    with BagReader(bags.make_bag(tmp_path / "bag")) as bag:
        last = list(bag.messages(["/scan"]))[-1]
    assert codec(LaserScan).decode(last.data).ranges[3] == 3 + bags.COUNT - 1
