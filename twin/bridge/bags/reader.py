"""Reads bags: ROS 2's (MCAP, SQLite, split, compressed, cut off by a crash) and ROS 1's."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Self

from twin.bridge.bags import metadata
from twin.bridge.bags.metadata import BagInfo, BagMessage, BagTopic
from twin.bridge.bags.sources import McapSource, Rosbag1Source, Rosbag2Source, Source
from twin.errors import RecordingError, nearest
from twin.files.reading import open_file

_MAGIC = {b"\x89MCAP0\r\n": "mcap", b"SQLite format 3\0": "sqlite3", b"#ROSBAG V2.0\n": "rosbag1"}
_NO_BAG = f"is not a bag; valid: a folder with {metadata.FILE}, a .mcap, .db3 or .bag file"
_FOREVER = 2**63 - 2


class BagReader:
    """An open bag."""

    def __init__(self, path: Path) -> None:
        """Open a bag: the folder of a ROS 2 bag, or a file (.mcap, .db3, .bag).

        Raises:
            RecordingError: not a bag, empty, of an unknown storage, or damaged before its first message.
        """
        self.path = path
        self._source = _open(path)
        self.info: BagInfo = self._source.info
        self.topics: dict[str, BagTopic] = {topic.name: topic for topic in self.info.topics}
        """By name."""

    @property
    def notices(self) -> tuple[str, ...]:
        """What is not as it should be, one sentence each; empty for a sound bag."""
        return tuple(self._source.notices)

    @property
    def size(self) -> int:
        """Bytes of all files."""
        if self.path.is_dir():
            return sum(file.stat().st_size for file in self.path.iterdir() if file.is_file())
        return self.path.stat().st_size

    def messages(
        self,
        topics: Collection[str] | None = None,
        start_ns: int = 0,
        end_ns: int = _FOREVER,
    ) -> Iterator[BagMessage]:
        """Yield messages by log time, equal times in the order of the bag.

        Args:
            topics: Their names; None is all.
            start_ns: Log time of the first [ns].
            end_ns: Log time of the last [ns].

        Raises:
            RecordingError: a topic that the bag does not have; the bag is damaged.
        """
        unknown = sorted(set(topics or ()) - set(self.topics))
        if unknown:
            raise self.no_topic(unknown[0])
        wanted = frozenset(self.topics if topics is None else topics)
        yield from self._source.messages(wanted, start_ns, end_ns)

    def last(self, counts: Mapping[str, int], until_ns: int) -> list[BagMessage]:
        """Return the last messages of topics up to a log time: what was known then.

        Args:
            counts: How many of each, by its name.
            until_ns: Log time of the last [ns].

        Raises:
            RecordingError: the bag is no MCAP; it is damaged.
        """
        return self._source.last(counts, until_ns)

    def no_topic(self, name: str) -> RecordingError:
        """Return what to say of a topic that the bag does not have."""
        return RecordingError(f"{self.path}: has no topic {name}; {nearest(name, self.topics)}")

    def attachment(self, name: str) -> bytes | None:
        """Return a file within the bag, None if there is none of this name."""
        return self._source.attachment(name)

    def close(self) -> None:
        """Close the files."""
        self._source.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _open(path: Path) -> Source:
    if path.is_dir():
        return _open_folder(path)
    kind = _kind(path)
    if kind == "mcap":
        return McapSource(path.parent, [path.name], None)
    return Rosbag2Source(path) if kind == "sqlite3" else Rosbag1Source(path)


def _open_folder(path: Path) -> Source:
    if not (path / metadata.FILE).exists():
        files = sorted(file.name for file in path.glob("*.mcap"))
        databases = sorted(path.glob("*.db3"))
        if not files and len(databases) != 1:
            raise RecordingError(f"{path}: {_NO_BAG}")
        source: Source = McapSource(path, files, None) if files else Rosbag2Source(databases[0])
        source.notices.insert(0, f"{path}: has no {metadata.FILE}, its recorder was stopped")
        return source
    info = metadata.read(path)
    missing = [name for name in info.files if not (path / name).is_file()]
    if missing or not info.files:
        raise RecordingError(f"{path}: {', '.join(missing) or 'its file'} is missing")
    if info.storage not in ("mcap", "sqlite3"):
        raise RecordingError(f"{path}: the storage {info.storage!r} is not known; valid: mcap, sqlite3")
    if info.storage == "mcap" and not info.compression_mode:
        return McapSource(path, info.files, info)
    return Rosbag2Source(path)


def _kind(path: Path) -> str:
    try:
        with open_file(path) as file:
            head = file.read(16)
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be read: {fault.strerror}") from fault
    if not head:
        raise RecordingError(f"{path}: is empty")
    for magic, kind in _MAGIC.items():
        if head.startswith(magic):
            return kind
    raise RecordingError(f"{path}: {_NO_BAG}")
