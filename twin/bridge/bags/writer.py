"""Writes bags: a folder with one file of messages and `metadata.yaml`."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self, get_args

from twin.bridge.bags import metadata
from twin.bridge.bags.compression import Compression
from twin.bridge.bags.definitions import complete
from twin.bridge.bags.metadata import BagInfo, BagMessage, BagTopic
from twin.errors import RecordingError

if TYPE_CHECKING:
    from twin.bridge.bags.mcap.writer import McapWriter
    from twin.bridge.bags.sqlite_writer import SqliteWriter

Storage = Literal["mcap", "sqlite3"]
"""What rosbag2 calls a storage identifier."""
STORAGES: tuple[Storage, ...] = get_args(Storage)


@dataclass(frozen=True, kw_only=True)
class BagConfig:
    """How a bag is written."""

    storage: Storage = "mcap"
    compression: Compression = "none"
    """With mcap of chunks; with sqlite3 of messages, none or zstd."""
    ros_distro: str = metadata.ROS_DISTRO


class BagWriter:
    """An open bag; with mcap, its end or a crash costs at most the last half second of log time."""

    def __init__(self, folder: Path, config: BagConfig | None = None) -> None:
        """Create the bag.

        Raises:
            RecordingError: it exists, or cannot be written.
        """
        self.folder = folder
        self.config = config or BagConfig()
        self.topics: dict[str, BagTopic] = {}
        """With the messages so far as `count`."""
        self._counts: Counter[str] = Counter()
        self._start_ns: int | None = None
        self._end_ns = 0
        self._closed = False
        self._storage = self._open_storage()

    @property
    def count(self) -> int:
        """Messages written."""
        return self._counts.total()

    def add_topic(self, topic: BagTopic) -> None:
        """Make a topic known, before its first message; a repeated name is ignored."""
        if topic.name not in self.topics:
            self.topics[topic.name] = full = complete(topic)
            self._storage.add_topic(full)

    def write(self, message: BagMessage) -> None:
        """Append a message of a known topic.

        Raises:
            RecordingError: the disk is full or gone.
        """
        self._storage.write(message)
        self._counts[message.topic] += 1
        self._start_ns = message.log_ns if self._start_ns is None else min(self._start_ns, message.log_ns)
        self._end_ns = max(self._end_ns, message.log_ns)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Append a file within the bag; other readers do not mind, SQLite bags have no place for it."""
        self._storage.attach(self._end_ns, name, media_type, data)

    def flush(self) -> None:
        """Make everything so far survive the end of this process.

        Raises:
            RecordingError: the disk is full or gone.
        """
        self._storage.flush()

    def info(self) -> BagInfo:
        """Return what metadata.yaml says, as of now."""
        start = self._start_ns or 0
        mode = self._storage.compression_mode
        return BagInfo(
            storage=self.config.storage,
            files=(self._storage.file,),
            start_ns=start,
            end_ns=max(start, self._end_ns),
            topics=tuple(replace(topic, count=self._counts[name]) for name, topic in self.topics.items()),
            compression_mode=mode,
            compression_format=self.config.compression if mode else "",
            ros_distro=self.config.ros_distro,
        )

    def close(self) -> None:
        """Write the end and metadata.yaml. Harmless when repeated.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._closed:
            return
        self._closed = True
        info = self.info()
        self._storage.close(info)
        metadata.write(self.folder, info)

    def leave(self) -> None:
        """Let it be as it is, without an end: the bag of a process that was killed. Harmless when closed."""
        self._closed = True
        self._storage.leave()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _open_storage(self) -> McapWriter | SqliteWriter:
        try:
            self.folder.mkdir(parents=True)
        except FileExistsError as fault:
            raise RecordingError(f"{self.folder} exists already; name another bag, or remove it") from fault
        except OSError as fault:
            raise RecordingError(f"{self.folder}: cannot be written: {fault.strerror}") from fault
        if self.config.storage == "mcap":
            from twin.bridge.bags.mcap.writer import McapWriter

            return McapWriter(self.folder, self.config.compression, self.config.ros_distro)
        from twin.bridge.bags.sqlite_writer import SqliteWriter

        return SqliteWriter(self.folder, self.config.compression, self.config.ros_distro)
