"""Where a bag's messages come from: our reader of MCAP, or rosbags' readers of everything else."""

from __future__ import annotations

import sqlite3
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from twin.bridge.bags import metadata, offered_qos
from twin.bridge.bags.definitions import complete
from twin.bridge.bags.mcap.reader import McapReader
from twin.bridge.bags.metadata import BagInfo, BagMessage, BagTopic
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.errors import BridgeError, RecordingError


class Source(ABC):
    """An open bag."""

    info: BagInfo

    def __init__(self) -> None:
        self.notices: list[str] = []
        """What a user should know, one sentence each."""

    @abstractmethod
    def messages(self, topics: Collection[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield the messages of topics, by log time from `start_ns` to `end_ns`, both inclusive."""

    def last(self, counts: Mapping[str, int], until_ns: int) -> list[BagMessage]:
        """Return the last messages of topics up to a log time, so many of each publisher, by log time.

        Raises:
            RecordingError: the bag has no index of times.
        """
        raise RecordingError("only bags of MCAP files tell what was at a time; twin bag convert makes one")

    def attachment(self, name: str) -> bytes | None:
        """Return a file within the bag, None if there is none of this name."""
        return None

    @abstractmethod
    def close(self) -> None:
        """Close the files."""


class McapSource(Source):
    """One or more MCAP files, in their order."""

    def __init__(self, folder: Path, files: Collection[str], known: BagInfo | None) -> None:
        """Open the files; `known` is what metadata.yaml says, None without it."""
        super().__init__()
        with ExitStack() as stack:
            self._files = [McapReader(folder / name) for name in files]
            for file in self._files:
                stack.callback(file.close)
                self._judge(file)
            self.info = self._read_info(tuple(files), known)
            self._stack = stack.pop_all()

    def messages(self, topics: Collection[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield messages by log time; files follow one another."""
        for file in self._files:
            names = {c.id: c.topic for c in file.channels.values() if _usable(c) and c.topic in topics}
            for m in file.messages(names, start_ns, end_ns):
                yield BagMessage(names[m.channel_id], m.data, m.log_time, m.publish_time, m.sequence)

    def last(self, counts: Mapping[str, int], until_ns: int) -> list[BagMessage]:
        """Look into the files from the last to the first; a topic is done with the first that has it."""
        left, found = dict(counts), []
        for file in reversed(self._files):
            names = {c.id: c.topic for c in file.channels.values() if _usable(c) and c.topic in left}
            messages = file.last({channel: left[name] for channel, name in names.items()}, until_ns)
            found.append(
                [
                    BagMessage(names[m.channel_id], m.data, m.log_time, m.publish_time, m.sequence)
                    for m in messages
                ]
            )
            left = {name: n for name, n in left.items() if name not in {m.topic for m in found[-1]}}
        return [message for each in reversed(found) for message in each]

    def attachment(self, name: str) -> bytes | None:
        """Return an attachment of the last file that has one of this name."""
        found = [data for file in self._files if (data := file.attachment(name)) is not None]
        return found[-1] if found else None

    def close(self) -> None:
        """Close the files."""
        self._stack.close()

    def _judge(self, file: McapReader) -> None:
        if file.damage:
            count = file.counts.total()
            self.notices.append(f"{file.path}: {file.damage}; {count} messages before that can be read")
        foreign = Counter(c.message_encoding for c in file.channels.values() if not _usable(c))
        if foreign and len(foreign) == len(file.channels):
            raise RecordingError(
                f"{file.path}: holds {', '.join(sorted(foreign))} messages; valid are those of ROS 2 (cdr)"
            )
        for encoding, topics in sorted(foreign.items()):
            self.notices.append(f"{file.path}: {topics} topics of {encoding} messages are left out")

    def _read_info(self, files: tuple[str, ...], known: BagInfo | None) -> BagInfo:
        topics: dict[str, BagTopic] = {}
        ranges = []
        told = known
        for file in self._files:
            ranges.append((file.start_ns, file.end_ns, file.counts.total()))
            text = file.metadata.get("rosbag2", {}).get("serialized_metadata")
            told = told or (metadata.parse(text) if text else None)
            for channel in file.channels.values():
                if _usable(channel):
                    _count(topics, _topic(file, channel), file.counts[channel.id])
        filled = [(start, end) for start, end, count in ranges if count]
        return BagInfo(
            storage="mcap",
            files=files,
            start_ns=min((start for start, _ in filled), default=0),
            end_ns=max((end for _, end in filled), default=0),
            topics=tuple(topics.values()),
            file_ranges=tuple(ranges),
            custom_data=told.custom_data if told else {},
            ros_distro=told.ros_distro if told else "",
        )


class _RosbagsSource(Source):
    """A bag that rosbags reads; the storage knows no other time than that of the log."""

    _what: ClassVar[str]

    def __init__(self, path: Path, reader: Callable[[Path], Any]) -> None:
        super().__init__()
        self._path = path
        with _foreign(path, self._what):
            self._reader = reader(path)
            self._reader.open()
        self._converters: dict[int, Callable[[bytes], bytes]] = {}
        """By connection; what has none is left out."""

    def messages(self, topics: Collection[str], start_ns: int, end_ns: int) -> Iterator[BagMessage]:
        """Yield messages by log time."""
        with _foreign(self._path, self._what):
            wanted = [c for c in self._reader.connections if c.topic in topics and c.id in self._converters]
            if wanted:
                for connection, time, data in self._reader.messages(wanted, start_ns, end_ns + 1):
                    yield BagMessage(connection.topic, self._converters[connection.id](data), time, time)

    def close(self) -> None:
        """Close the files."""
        self._reader.close()

    def _filled(self, info: BagInfo, topics: dict[str, BagTopic]) -> BagInfo:
        """Return `info` with the topics, and with the reader's times."""
        reader, filled = self._reader, self._reader.message_count > 0
        start, end = (reader.start_time, reader.end_time - 1) if filled else (0, 0)
        return replace(info, start_ns=start, end_ns=end, topics=tuple(topics.values()))


class Rosbag2Source(_RosbagsSource):
    """A SQLite bag, or one with compressed files or messages."""

    _what = "a ROS 2 bag"

    def __init__(self, path: Path) -> None:
        """Open a folder with metadata.yaml, or one .db3 file."""
        from rosbags.rosbag2 import Reader

        logs = sorted(path.glob("*.db3-wal")) if path.is_dir() else [path.with_name(f"{path.name}-wal")]
        recovered = [notice for log in logs for notice in _recover(log)]
        super().__init__(path, Reader)
        self.notices += recovered
        topics: dict[str, BagTopic] = {}
        for c in self._reader.connections:
            self._converters[c.id] = bytes
            topic = BagTopic(
                name=c.topic,
                type=c.msgtype,
                type_hash=c.digest,
                definition=c.msgdef.data,
                definition_format="ros2idl" if c.msgdef.format.name == "IDL" else "ros2msg",
                qos=tuple(map(offered_qos.from_rosbags, c.ext.offered_qos_profiles)),
            )
            _count(topics, topic, c.msgcount)
        alone = BagInfo(storage="sqlite3", files=(path.name,))
        self.info = self._filled(metadata.read(path) if path.is_dir() else alone, topics)


class Rosbag1Source(_RosbagsSource):
    """A ROS 1 bag, its messages converted to ROS 2's types."""

    _what = "a ROS 1 bag"

    def __init__(self, path: Path) -> None:
        """Open a .bag file."""
        from rosbags.rosbag1 import Reader

        from twin.bridge.bags.ros1 import FromRos1

        super().__init__(path, Reader)
        types_of_bag = FromRos1()
        topics: dict[str, BagTopic] = {}
        for c in self._reader.connections:
            try:
                typename, self._converters[c.id] = types_of_bag.converter(c.msgtype, c.msgdef.data)
            except BridgeError as fault:
                self.notices.append(f"{path}: {c.msgcount} messages on {c.topic} are left out: {fault}")
                continue
            latched = OfferedQoS(history="keep_last", depth=1, durability="transient_local")
            qos = (latched if c.ext.latching else OfferedQoS(history="keep_last", depth=10),)
            _count(topics, complete(BagTopic(name=c.topic, type=typename, qos=qos)), c.msgcount)
        self.info = self._filled(BagInfo(storage="rosbag1", files=(path.name,)), topics)


@contextmanager
def _foreign(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a library says of bytes that it cannot read into one sentence."""
    try:
        yield
    except RecordingError:
        raise
    except Exception as fault:  # rosbags' readers raise many kinds on damaged files
        words = " ".join(str(fault).split()).rstrip(".") or type(fault).__name__
        raise RecordingError(f"{path}: cannot be read as {what}: {words}") from fault


def _recover(log: Path) -> Iterator[str]:
    """Take over what a recorder that was killed had flushed, and yield a notice of it."""
    if not log.exists():
        return
    database = log.with_name(log.name.removesuffix("-wal"))
    try:
        connection = sqlite3.connect(database)
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        connection.close()
    except sqlite3.Error as fault:
        raise RecordingError(f"{database}: cannot be recovered: {fault}") from fault
    yield f"{database}: its writer was stopped; what it had flushed was recovered"


def _usable(channel: Any) -> bool:
    return bool(channel.message_encoding == "cdr")


def _topic(file: McapReader, channel: Any) -> BagTopic:
    schema = file.schemas.get(channel.schema_id)
    if schema is None:
        raise RecordingError(f"{file.path}: the type of {channel.topic} is missing")
    return BagTopic(
        name=channel.topic,
        type=schema.name,
        type_hash=channel.metadata.get("topic_type_hash", ""),
        definition=schema.data.decode(errors="replace"),
        definition_format=schema.encoding or "ros2msg",
        qos=offered_qos.parse(channel.metadata.get("offered_qos_profiles")),
    )


def _count(topics: dict[str, BagTopic], topic: BagTopic, count: int) -> None:
    """Add a topic, or the messages of another publisher or file to it."""
    known = topics.get(topic.name, topic)
    topics[topic.name] = replace(known, count=known.count + count)
