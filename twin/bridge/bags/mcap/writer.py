"""Writes MCAP files of which a crash costs only the chunk in work."""

from __future__ import annotations

import zlib
from collections import Counter
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

from twin.bridge.bags.compression import Compression, compress, mcap_name
from twin.bridge.bags.mcap.fields import text, text_map
from twin.bridge.bags.mcap.records import (
    MAGIC,
    Attachment,
    Channel,
    ChunkHead,
    ChunkIndex,
    Message,
    Op,
    Schema,
    Statistics,
    footer,
    message_index,
    metadata_index,
    record,
    summary_offset,
)
from twin.errors import RecordingError


@dataclass(frozen=True, kw_only=True)
class McapConfig:
    """How a file is written."""

    library: str = "twin"
    compression: Compression = "none"
    chunk_bytes: int = 1 << 20
    """A chunk is written when it has so many bytes ..."""
    chunk_ns: int = 500_000_000
    """... or when its messages span so much log time [ns]; only the chunk in work is lost in a crash."""


class McapWriter:
    """Appends messages; each chunk goes to the operating system in one write, followed by its index."""

    def __init__(self, path: Path, config: McapConfig | None = None) -> None:
        """Create the file.

        Raises:
            RecordingError: it cannot be written, or exists.
        """
        self.path = path
        self.config = config or McapConfig()
        self.size = 0
        """Bytes in the file."""
        self._compression = mcap_name(self.config.compression)
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._counts: Counter[int] = Counter()
        self._chunks: list[ChunkIndex] = []
        self._start_ns, self._end_ns = 0, 0
        self._attachments: list[bytes] = []
        self._metadata: list[bytes] = []
        self._chunk_start = self._chunk_end = 0
        self._begin_chunk()
        self._file = _create(path)
        self._append(MAGIC + record(Op.HEADER, text("ros2"), text(self.config.library)))

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Add a type; return its id."""
        schema = Schema(len(self._schemas) + 1, name, encoding, data)
        self._schemas[schema.id] = schema
        self._add(schema.pack())
        return schema.id

    def add_channel(self, topic: str, schema_id: int, metadata: dict[str, str]) -> int:
        """Add a topic of CDR messages; return its id."""
        channel = Channel(len(self._channels) + 1, schema_id, topic, "cdr", metadata)
        self._channels[channel.id] = channel
        self._add(channel.pack())
        return channel.id

    def write(self, message: Message) -> None:
        """Append a message.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._chunk_messages and message.log_ns - self._chunk_start >= self.config.chunk_ns:
            self.flush()
        if not self._chunk_messages:
            self._chunk_start = self._chunk_end = message.log_ns
        if not self._counts:
            self._start_ns = self._end_ns = message.log_ns
        self._chunk_start = min(self._chunk_start, message.log_ns)
        self._chunk_end = max(self._chunk_end, message.log_ns)
        self._start_ns = min(self._start_ns, message.log_ns)
        self._end_ns = max(self._end_ns, message.log_ns)
        self._index.setdefault(message.channel_id, []).append((message.log_ns, self._chunk_size))
        self._counts[message.channel_id] += 1
        self._chunk_messages += 1
        self._add(message.pack())
        if self._chunk_size >= self.config.chunk_bytes:
            self.flush()

    def flush(self) -> None:
        """Hand the chunk in work to the operating system: from now on it survives the end of this process.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if not self._chunk:
            return
        data = b"".join(self._chunk)
        packed = compress(data, self._compression)
        head = ChunkHead(
            self._chunk_start, self._chunk_end, len(data), zlib.crc32(data), self._compression, packed
        )
        chunk = head.pack()
        indexes, offsets = [], {}
        at = self.size + len(chunk)
        for channel_id, entries in self._index.items():
            offsets[channel_id] = at
            indexes.append(message_index(channel_id, entries))
            at += len(indexes[-1])
        length = at - self.size - len(chunk)
        self._chunks.append(
            ChunkIndex(
                head.start_ns,
                head.end_ns,
                self.size,
                len(chunk),
                offsets,
                length,
                head.compression,
                len(packed),
                head.size,
            )
        )
        self._append(b"".join([chunk, *indexes]))
        self._begin_chunk()

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Append named texts, after the chunk in work."""
        self.flush()
        data = record(Op.METADATA, text(name), text_map(values))
        self._metadata.append(metadata_index(self.size, len(data), name))
        self._append(data)

    def add_attachment(self, attachment: Attachment) -> None:
        """Append a file within the file, after the chunk in work."""
        self.flush()
        data = attachment.pack()
        self._attachments.append(attachment.index_record(self.size, len(data)))
        self._append(data)

    def close(self) -> None:
        """Write what is left and the summary. Harmless when repeated.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._file.closed:
            return
        try:
            self.flush()
            self._append(record(Op.DATA_END, bytes(4)))
            self._append(self._summary())
        finally:
            self._file.close()

    def _summary(self) -> bytes:
        statistics = Statistics(
            self._counts.total(),
            len(self._schemas),
            len(self._channels),
            len(self._attachments),
            len(self._metadata),
            len(self._chunks),
            self._start_ns,
            self._end_ns,
            dict(self._counts),
        )
        groups = {
            Op.SCHEMA: [schema.pack() for schema in self._schemas.values()],
            Op.CHANNEL: [channel.pack() for channel in self._channels.values()],
            Op.STATISTICS: [statistics.pack()],
            Op.CHUNK_INDEX: [chunk.pack() for chunk in self._chunks],
            Op.ATTACHMENT_INDEX: self._attachments,
            Op.METADATA_INDEX: self._metadata,
        }
        at, offsets = self.size, []
        for group, records in groups.items():
            length = sum(map(len, records))
            if records:
                offsets.append(summary_offset(group, at, length))
            at += length
        summary = b"".join([*(item for records in groups.values() for item in records), *offsets])
        return summary + footer(summary, self.size, at) + MAGIC

    def _begin_chunk(self) -> None:
        self._chunk: list[bytes] = []
        self._chunk_size = self._chunk_messages = 0
        self._index: dict[int, list[tuple[int, int]]] = {}

    def _add(self, data: bytes) -> None:
        self._chunk.append(data)
        self._chunk_size += len(data)

    def _append(self, data: bytes) -> None:
        left = memoryview(data)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as fault:
            self._file.truncate(self.size)  # the file still ends after a whole record
            raise RecordingError(f"{self.path}: cannot be written: {fault.strerror}") from fault
        self.size += len(data)


def _create(path: Path) -> FileIO:
    try:
        return path.open("xb", buffering=0)
    except FileExistsError as fault:
        raise RecordingError(f"{path} exists already; name another bag, or remove it") from fault
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be written: {fault.strerror}") from fault
