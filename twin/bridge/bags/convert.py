"""Converts a bag into another storage; a bag that was cut off becomes whole on the way."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, cast, get_args

from twin.bridge.bags.compression import Compression
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.errors import BridgeError, RecordingError, nearest

Target = Literal["mcap", "sqlite3", "rosbag1"]
"""What a bag can become."""


@dataclass(frozen=True, kw_only=True)
class Converted:
    """What a conversion did."""

    messages: int
    topics: int
    notices: tuple[str, ...]
    """What was wrong with the bag or had to be left out, one sentence each."""


class _Writer(Protocol):
    def add_topic(self, topic: BagTopic) -> None: ...

    def write(self, message: BagMessage) -> None: ...

    def close(self) -> None: ...


def as_target(name: str) -> Target:
    """Return the target of that name.

    Raises:
        RecordingError: there is none.
    """
    if name not in get_args(Target):
        raise RecordingError(f"{name!r} is no storage of bags; {nearest(name, get_args(Target))}")
    return cast(Target, name)


def convert(
    source: Path,
    target: Path,
    *,
    storage: Target = "mcap",
    topics: Collection[str] | None = None,
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
        wanted = select(tuple(bag.topics), topics or None)
        notices = list(bag.notices)
        writer = _open(target, storage, compression, bag.info.ros_distro)
        count, usable = 0, set()
        try:
            for name in wanted:
                try:
                    writer.add_topic(bag.topics[name])
                    usable.add(name)
                except BridgeError as fault:
                    left = bag.topics[name].count
                    notices.append(f"{source}: {left} messages on {name} are left out: {fault}")
            for message in bag.messages(usable):
                writer.write(message)
                count += 1
        finally:
            writer.close()
    return Converted(messages=count, topics=len(usable), notices=tuple(notices))


def select(
    names: Collection[str],
    topics: Collection[str] | None = None,
    regex: str = "",
    exclude: str = "",
) -> tuple[str, ...]:
    """Return those of the names that are meant, sorted.

    Args:
        names: To choose from.
        topics: Names; None is all, unless there is a regex.
        regex: Chooses too; the whole name must match.
        exclude: Regex of names to leave out.

    Raises:
        RecordingError: a topic that is not among the names, or no regular expression.
    """
    unknown = sorted(set(topics or ()) - set(names))
    if unknown:
        raise RecordingError(f"there is no topic {unknown[0]}; {nearest(unknown[0], names)}")
    chosen = chooser(topics, regex, exclude)
    return tuple(sorted(name for name in names if chosen(name)))


def chooser(
    topics: Collection[str] | None = None, regex: str = "", exclude: str = ""
) -> Callable[[str], bool]:
    """Return whether a topic's name is meant, as `select` says, for names that are not known yet."""
    included, excluded = (_pattern(text) for text in (regex, exclude))
    everything = topics is None and not regex

    def chosen(name: str) -> bool:
        wanted = everything or name in (topics or ()) or (regex and included.fullmatch(name))
        return bool(wanted) and not (exclude and excluded.fullmatch(name))

    return chosen


def _pattern(text: str) -> re.Pattern[str]:
    try:
        return re.compile(text)
    except re.error as fault:
        raise RecordingError(f"{text!r} is not a regular expression: {fault}") from fault


def _open(target: Path, storage: Target, compression: Compression, ros_distro: str) -> _Writer:
    if storage == "rosbag1":
        return _Rosbag1Writer(target, compression)
    config = BagConfig(storage=storage, compression=compression)
    return BagWriter(target, config)


class _Rosbag1Writer:
    """A ROS 1 bag, by rosbags."""

    def __init__(self, path: Path, compression: Compression) -> None:
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
        self._types = ToRos1()
        self._connections: dict[str, tuple[Any, Callable[[bytes], bytes]]] = {}

    def add_topic(self, topic: BagTopic) -> None:
        if topic.definition:
            from twin.bridge.bags.definitions import learn

            learn(topic.type, topic.definition)
        convert_message = self._types.converter(topic.type)
        connection = self._writer.add_connection(
            topic.name, topic.type, typestore=self._types.store, latching=int(topic.latched)
        )
        self._connections[topic.name] = (connection, convert_message)

    def write(self, message: BagMessage) -> None:
        connection, convert_message = self._connections[message.topic]
        try:
            data = convert_message(message.data)
        except Exception as fault:  # rosbags' converters raise many kinds on damaged payloads
            words = f"at {message.log_ns} ns is not a {connection.msgtype}: {fault}"
            raise RecordingError(f"the message on {message.topic} {words}") from fault
        self._writer.write(connection, message.log_ns, data)

    def close(self) -> None:
        self._writer.close()
