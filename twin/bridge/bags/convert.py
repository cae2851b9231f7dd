"""Converts a bag into another storage; a bag that was cut off becomes whole on the way."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from twin.bridge.bags.compression import Compression
from twin.bridge.bags.definitions import learn
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.topic_choice import TopicChoice
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.errors import BridgeError, RecordingError

Target = Literal["mcap", "sqlite3", "rosbag1"]
"""What a bag can become."""
TARGETS: tuple[Target, ...] = get_args(Target)


@dataclass(frozen=True, kw_only=True)
class Converted:
    """What a conversion did."""

    messages: int
    topics: int
    notices: tuple[str, ...]
    """What was wrong with the bag or had to be left out, one sentence each."""


def convert(
    source: Path,
    target: Path,
    *,
    storage: Target = "mcap",
    topics: TopicChoice | None = None,
    compression: Compression = "none",
) -> Converted:
    """Write the messages of a bag into a new one.

    Args:
        source: The bag.
        target: Folder of the new bag; with rosbag1 its file.
        storage: Of the new bag.
        topics: Which ones; None is all.
        compression: Of the new bag; rosbag1 knows none and lz4.

    Raises:
        RecordingError: the bag cannot be read or the new one not be written.
    """
    with BagReader(source) as bag:
        wanted = (topics or TopicChoice()).of(bag.topics)
        notices = list(bag.notices)
        writer = (
            _Rosbag1Writer(target, compression, notices)
            if storage == "rosbag1"
            else BagWriter(target, BagConfig(storage=storage, compression=compression))
        )
        try:
            count, usable = _copy(bag, wanted, writer, notices)
        except BaseException:  # Ctrl-C too: half a bag would be in the way of the next attempt
            with suppress(Exception):
                writer.close()
            _remove(target)
            raise
    return Converted(messages=count, topics=usable, notices=tuple(notices))


def _copy(
    bag: BagReader, wanted: Iterable[str], writer: BagWriter | _Rosbag1Writer, notices: list[str]
) -> tuple[int, int]:
    """Write topics and their messages, and the end; return how many messages, and of how many topics."""
    count, usable = 0, set()
    for name in wanted:
        try:
            writer.add_topic(bag.topics[name])
            usable.add(name)
        except BridgeError as fault:
            left = bag.topics[name].count
            notices.append(f"{bag.path}: {left} messages on {name} are left out: {fault}")
    for message in bag.messages(usable):
        writer.write(message)
        count += 1
    writer.close()
    return count, len(usable)


def _remove(target: Path) -> None:
    if target.is_dir():
        shutil.rmtree(target, ignore_errors=True)
    else:
        target.unlink(missing_ok=True)


class _Rosbag1Writer:
    """A ROS 1 bag, by rosbags."""

    def __init__(self, path: Path, compression: Compression, notices: list[str]) -> None:
        from rosbags.rosbag1 import Writer, WriterError

        from twin.bridge.bags.ros1 import ToRos1

        if compression == "zstd":
            raise RecordingError("a ROS 1 bag cannot be compressed with zstd; valid: none, lz4")
        if path.suffix != ".bag":
            raise RecordingError(f"{path}: the name of a ROS 1 bag must end in .bag")
        try:
            self._writer: Any = Writer(path)
            if compression == "lz4":
                self._writer.set_compression(Writer.CompressionFormat.LZ4)
            self._writer.open()
        except WriterError as fault:
            raise RecordingError(f"{path} exists already; name another bag, or remove it") from fault
        except OSError as fault:
            raise RecordingError(f"{path}: cannot be written: {fault.strerror}") from fault
        self._path, self._notices = path, notices
        self._types = ToRos1()
        self._connections: dict[str, tuple[Any, Callable[[bytes], tuple[bytes, bool]]]] = {}
        self._trailing: Counter[str] = Counter()

    def add_topic(self, topic: BagTopic) -> None:
        if topic.definition:
            learn(topic.type, topic.definition)
        convert_message = self._types.converter(topic.type)
        connection = self._writer.add_connection(
            topic.name, topic.type, typestore=self._types.store, latching=int(topic.latched)
        )
        self._connections[topic.name] = (connection, convert_message)

    def write(self, message: BagMessage) -> None:
        connection, convert_message = self._connections[message.topic]
        try:
            data, is_exact = convert_message(message.data)
        except Exception as fault:  # rosbags' converters raise many kinds on damaged payloads
            words = f"at {message.log_ns} ns is not a {connection.msgtype}: {fault}"
            raise RecordingError(f"the message on {message.topic} {words}") from fault
        self._trailing[message.topic] += not is_exact
        self._writer.write(connection, message.log_ns, data)

    def close(self) -> None:
        self._writer.close()
        self._notices += [
            f"{self._path}: messages on {topic} with bytes after their end, which are left out: {count}"
            for topic, count in sorted(self._trailing.items())
            if count
        ]
