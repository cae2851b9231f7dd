"""Writes MCAP files of which a crash costs only the chunk in work."""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from twin.bridge.bags import metadata
from twin.bridge.bags.compression import Compression
from twin.bridge.bags.metadata import BagInfo, BagMessage, BagTopic
from twin.bridge.bags.offered_qos import to_yaml
from twin.errors import RecordingError

_CHUNK_BYTES = 1 << 20
"""A chunk is written when its messages have so many bytes ..."""
_CHUNK_NS = 500_000_000
"""... or span so much log time [ns]; only the chunk in work is lost in a crash."""
_COMPRESSION = {"none": CompressionType.NONE, "zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}


class McapWriter:
    """The file of a bag."""

    compression_mode = ""  # of chunks, which MCAP itself tells

    def __init__(self, folder: Path, how: Compression, ros_distro: str) -> None:
        """Create it.

        Raises:
            RecordingError: it cannot be written, or exists.
        """
        self.file = f"{folder.resolve().name}_0.mcap"
        self._output = _WholeRecords(folder / self.file)
        # Chunks end where `write` says so.
        self._writer: Any = Writer(
            self._output,  # type: ignore[arg-type]
            chunk_size=sys.maxsize,
            compression=_COMPRESSION[how],
        )
        self._writer.start("ros2", f"twin {version('twin')}")
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels: dict[str, int] = {}
        self._chunk_bytes, self._chunk_start = 0, 0
        # As rosbag2: readers of a file that has no end know its version and distribution.
        self._tell(BagInfo(storage="mcap", files=(self.file,), ros_distro=ros_distro))

    def add_topic(self, topic: BagTopic) -> None:
        """Make a topic known."""
        key = (topic.type, topic.definition)
        if key not in self._schemas:
            encoding = topic.definition_format if topic.definition else ""
            self._schemas[key] = self._writer.register_schema(topic.type, encoding, topic.definition.encode())
        told = {"offered_qos_profiles": to_yaml(topic.qos), "topic_type_hash": topic.type_hash}
        self._channels[topic.name] = self._writer.register_channel(
            topic.name, "cdr", self._schemas[key], told
        )

    def write(self, message: BagMessage) -> None:
        """Append a message.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._chunk_bytes and message.log_ns - self._chunk_start >= _CHUNK_NS:
            self.flush()
        self._chunk_start = min(self._chunk_start, message.log_ns) if self._chunk_bytes else message.log_ns
        self._chunk_bytes += len(message.data) + 1
        self._writer.add_message(
            self._channels[message.topic],
            message.log_ns,
            message.data,
            message.publish_ns,
            message.sequence & 0xFFFFFFFF,
        )
        if self._chunk_bytes >= _CHUNK_BYTES:
            self.flush()

    def attach(self, log_ns: int, name: str, media_type: str, data: bytes) -> None:
        """Append a file within the file, after the chunk in work."""
        self.flush()
        self._writer.add_attachment(log_ns, log_ns, name, media_type, data)
        self._output.flush()

    def flush(self) -> None:
        """Hand the chunk in work to the operating system: from now on it survives the end of this process.

        Raises:
            RecordingError: the disk is full or gone.
        """
        self._chunk_bytes = 0
        self._writer.flush()

    def close(self, info: BagInfo) -> None:
        """Write what is left and the summary.

        Raises:
            RecordingError: the disk is full or gone.
        """
        try:
            self._tell(info)
            self._writer.finish()
            self._output.flush()
        finally:
            self._output.close()

    def leave(self) -> None:
        """Close the file without an end."""
        self._output.close()

    def _tell(self, info: BagInfo) -> None:
        self.flush()
        self._writer.add_metadata("rosbag2", {"serialized_metadata": metadata.to_yaml(info)})
        self._output.flush()


class _WholeRecords:
    """A file that always ends after a whole record: what is written waits until it is flushed."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.size = 0
        """Bytes in the file."""
        self._waiting = bytearray()
        try:
            self._file = path.open("xb", buffering=0)
        except FileExistsError as fault:
            raise RecordingError(f"{path} exists already; name another bag, or remove it") from fault
        except OSError as fault:
            raise RecordingError(f"{path}: cannot be written: {fault.strerror}") from fault

    def write(self, data: bytes) -> None:
        self._waiting += data

    def tell(self) -> int:
        return self.size + len(self._waiting)

    def flush(self) -> None:
        left = memoryview(bytes(self._waiting))
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as fault:
            self._file.truncate(self.size)
            raise RecordingError(f"{self._path}: cannot be written: {fault.strerror}") from fault
        self.size += len(self._waiting)
        self._waiting.clear()

    def close(self) -> None:
        self._file.close()
