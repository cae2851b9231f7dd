"""Reads MCAP files: by their summary, or by looking through them where it is missing or wrong.

The records are those of the library `mcap`. Its own readers stop at what a crash left unfinished, and take as
much memory for a chunk as the chunk says; here a torn file is read to its last whole record, and a chunk that
says one thing and is another costs an error.
"""

from __future__ import annotations

import heapq
import zlib
from collections import Counter
from collections.abc import Container, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from struct import Struct
from typing import Any, BinaryIO, NamedTuple

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC as MAGIC

from twin.bridge.bags.compression import decompress
from twin.errors import RecordingError
from twin.files.reading import open_file

_HEAD = Struct("<BQ")
"""Opcode and length of a record."""
_MESSAGE = Struct("<HIQQ")
_FOOTER_SIZE = _HEAD.size + 20
_LARGEST_RECORD = 1 << 32

_KINDS: dict[int, Any] = {
    Opcode.SCHEMA: records.Schema,
    Opcode.CHANNEL: records.Channel,
    Opcode.CHUNK: records.Chunk,
    Opcode.CHUNK_INDEX: records.ChunkIndex,
    Opcode.STATISTICS: records.Statistics,
    Opcode.ATTACHMENT: records.Attachment,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
    Opcode.METADATA: records.Metadata,
    Opcode.METADATA_INDEX: records.MetadataIndex,
    Opcode.FOOTER: records.Footer,
}
"""What is read; other records are passed over."""


class _Block(NamedTuple):
    """A chunk, or a message outside of chunks, in the file."""

    start_ns: int
    end_ns: int
    offset: int
    length: int
    channels: frozenset[int] | None
    """Whose messages are in it; None: nobody tells."""


class McapReader:
    """An open file; `damage` says what is wrong with it, everything else is what could be read."""

    def __init__(self, path: Path) -> None:
        """Open a file and read its summary, or everything if there is none.

        Raises:
            RecordingError: not an MCAP file, or it cannot be read.
        """
        self.path = path
        self.damage = ""
        """Empty, or one clause such as 'ends in the middle of a chunk'."""
        self._forget()
        try:
            self._file: BinaryIO = open_file(path)
            self._size = path.stat().st_size
        except OSError as fault:
            raise RecordingError(f"{path}: cannot be read: {fault.strerror}") from fault
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def messages(self, channels: Container[int], first_ns: int, last_ns: int) -> Iterator[records.Message]:
        """Yield messages by log time, from `first_ns` to `last_ns` inclusive; equal times as in the file.

        Raises:
            RecordingError: a chunk is damaged.
        """
        blocks = [b for b in self._blocks if b.start_ns <= last_ns and b.end_ns >= first_ns]
        blocks.sort(key=lambda block: (block.start_ns, block.offset))
        waiting: list[tuple[int, int, int, records.Message]] = []
        for block in blocks:
            # Nothing in this or a later block is earlier than its start.
            while waiting and waiting[0][0] < block.start_ns:
                yield heapq.heappop(waiting)[3]
            for number, message in enumerate(self._messages_of(block)):
                if message.channel_id in channels and first_ns <= message.log_time <= last_ns:
                    heapq.heappush(waiting, (message.log_time, block.offset, number, message))
        while waiting:
            yield heapq.heappop(waiting)[3]

    def last(self, counts: Mapping[int, int], until_ns: int) -> list[records.Message]:
        """Return the last messages of channels up to a log time, by that; equal times as in the file.

        Only chunks are read that hold such a channel, the latest first, until each has so many messages.

        Args:
            counts: How many of each channel.
            until_ns: Log time of the last [ns].

        Raises:
            RecordingError: a chunk is damaged.
        """
        blocks = sorted((b for b in self._blocks if b.start_ns <= until_ns), key=lambda b: b.end_ns)
        found: dict[int, list[tuple[int, int, int, records.Message]]] = {each: [] for each in counts}
        for block in reversed(blocks):
            # Done with a channel: it has enough, none of them earlier than anything in blocks to come.
            wanted = {
                channel
                for channel, count in counts.items()
                if len(kept := found[channel]) < count or kept[0][0] < block.end_ns
            }
            if not wanted:
                break
            if block.channels is not None and not block.channels & wanted:
                continue
            for number, message in enumerate(self._messages_of(block)):
                if message.channel_id in wanted and message.log_time <= until_ns:
                    found[message.channel_id].append((message.log_time, block.offset, number, message))
            for channel in wanted:
                found[channel] = sorted(found[channel])[-counts[channel] :]
        return [each[3] for each in sorted(entry for kept in found.values() for entry in kept)]

    def attachment(self, name: str) -> bytes | None:
        """Return the last attachment of that name, None if there is none."""
        if name not in self._attachments:
            return None
        return self._record_at(*self._attachments[name]).data

    def close(self) -> None:
        """Close the file. Harmless when repeated."""
        self._file.close()

    def _forget(self) -> None:
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, records.Channel] = {}
        self.counts: Counter[int] = Counter()
        """Messages by channel."""
        self.start_ns, self.end_ns = 0, 0
        """Log time of the first and the last message [ns]."""
        self.metadata: dict[str, dict[str, str]] = {}
        """By name; of several of a name the last."""
        self._blocks: list[_Block] = []
        self._attachments: dict[str, tuple[int, int]] = {}

    def _open(self) -> None:
        head = self._read(0, min(len(MAGIC) + _HEAD.size, self._size))
        if not head:
            raise RecordingError(f"{self.path}: is empty")
        if not head.startswith(MAGIC[: len(head)]):
            raise RecordingError(f"{self.path}: is not an MCAP file")
        try:
            self._read_summary()
        except ValueError as fault:
            self.damage = str(fault)
            self._forget()
            self._scan()

    def _read_summary(self) -> None:
        """Read the summary; raises ValueError if there is none that can be trusted."""
        if self._size < len(MAGIC) + _FOOTER_SIZE + len(MAGIC):
            raise ValueError("ends too early")
        end = self._size - len(MAGIC) - _FOOTER_SIZE
        tail = self._read(end, _FOOTER_SIZE + len(MAGIC))
        if not tail.endswith(MAGIC):
            raise ValueError("ends in the middle: its writer was stopped")
        footer: records.Footer = _parse(Opcode.FOOTER, tail[_HEAD.size : _FOOTER_SIZE])
        if footer.summary_start == 0:
            raise ValueError("")  # allowed
        if footer.summary_start > end:
            raise ValueError("has a damaged footer")
        summary = self._read(footer.summary_start, end - footer.summary_start)
        if footer.summary_crc and zlib.crc32(summary + tail[: _FOOTER_SIZE - 4]) != footer.summary_crc:
            raise ValueError("has a damaged summary")
        statistics = None
        same: dict[frozenset[int] | None, frozenset[int] | None] = {}  # a set for all that are equal
        for op, content in _records(summary):
            record = _parse(op, content)
            if isinstance(record, records.ChunkIndex):
                times = record.message_start_time, record.message_end_time
                channels = frozenset(record.message_index_offsets) or None
                channels = same.setdefault(channels, channels)
                block = _Block(*times, record.chunk_start_offset, record.chunk_length, channels)
                self._blocks.append(block)
            elif isinstance(record, records.Statistics):
                statistics = record
            elif isinstance(record, records.MetadataIndex):
                self._keep(self._record_at(record.offset, record.length))
            elif isinstance(record, records.AttachmentIndex):
                self._attachments[record.name] = (record.offset, record.length)
            else:
                self._keep(record)
        found = len(self._blocks), len(self.channels)
        if statistics is None or found != (statistics.chunk_count, statistics.channel_count):
            raise ValueError("has an incomplete summary")
        if statistics.message_count and not self._blocks:
            raise ValueError("")  # written without chunks: no damage, but no index either
        self.counts = Counter(statistics.channel_message_counts)
        self.start_ns, self.end_ns = statistics.message_start_time, statistics.message_end_time

    def _scan(self) -> None:
        """Look through the records up to the first that is not whole."""
        at = len(MAGIC)
        while at + _HEAD.size <= self._size:
            op, length = _HEAD.unpack(self._read(at, _HEAD.size))
            whole = _HEAD.size + length
            if op in (Opcode.DATA_END, Opcode.FOOTER):
                break
            if at + whole > self._size or length > _LARGEST_RECORD:
                self.damage = self.damage or "ends in the middle"
                break
            try:
                if op != Opcode.MESSAGE_INDEX:
                    self._scan_record(op, at, whole)
            except ValueError as fault:
                self.damage = f"is damaged at byte {at}: {fault}"
                break
            at += whole

    def _scan_record(self, op: int, at: int, whole: int) -> None:
        record = _parse(op, self._read(at + _HEAD.size, whole - _HEAD.size))
        if isinstance(record, records.Attachment):
            self._attachments[record.name] = (at, whole)
        elif isinstance(record, records.Chunk):
            before = self.counts.copy()
            for inner, content in _records(_unpacked(record)):
                self._keep(_parse(inner, content))
            times = record.message_start_time, record.message_end_time
            channels = frozenset(self.counts - before)
            self._blocks.append(_Block(*times, at, whole, channels))
        else:
            self._keep(record)
            if isinstance(record, records.Message):
                channels = frozenset([record.channel_id])
                self._blocks.append(_Block(record.log_time, record.log_time, at, whole, channels))

    def _keep(self, record: records.McapRecord | None) -> None:
        """Take in what a record tells."""
        if isinstance(record, records.Schema):
            self.schemas[record.id] = record
        elif isinstance(record, records.Channel):
            self.channels[record.id] = record
        elif isinstance(record, records.Metadata):
            self.metadata[record.name] = record.metadata
        elif isinstance(record, records.Message):
            time = record.log_time
            self.start_ns = min(self.start_ns, time) if self.counts else time
            self.end_ns = max(self.end_ns, time) if self.counts else time
            self.counts[record.channel_id] += 1

    def _messages_of(self, block: _Block) -> Iterator[records.Message]:
        try:
            record = self._record_at(block.offset, block.length)
            if isinstance(record, records.Message):
                yield record
            elif isinstance(record, records.Chunk):
                for op, content in _records(_unpacked(record)):
                    if op == Opcode.MESSAGE:
                        yield _parse(op, content)
        except ValueError as fault:
            raise RecordingError(
                f"{self.path}: the chunk at byte {block.offset} is damaged: {fault}"
            ) from fault

    def _record_at(self, offset: int, length: int) -> Any:
        """Return the record of `length` bytes at an offset; raises ValueError if there is none."""
        data = self._read(offset, length)
        return _parse(data[0], data[_HEAD.size :]) if data else None

    def _read(self, offset: int, size: int) -> bytes:
        try:
            self._file.seek(offset)
            data = self._file.read(size)
        except (OSError, OverflowError) as fault:
            raise RecordingError(f"{self.path}: cannot be read: {fault}") from fault
        if len(data) != size:
            raise ValueError("ends too early")
        return data


class _Fields(ReadDataStream):
    """The content of a record; raises ValueError where fields go beyond it."""

    def read(self, length: int) -> bytes:
        try:
            data = super().read(length)
        except EndOfFile:
            data = b""
        if len(data) != length:
            raise ValueError("a record ends too early")
        return data


def _parse(op: int, content: bytes) -> Any:
    """Return a record, None for one of a kind that is not read; raises ValueError if it is none."""
    if op == Opcode.MESSAGE:  # most records are: in one go
        if len(content) < _MESSAGE.size:
            raise ValueError("a record ends too early")
        channel, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(content)
        return records.Message(channel, log_ns, content[_MESSAGE.size :], publish_ns, sequence)
    return _KINDS[op].read(_Fields(BytesIO(content))) if op in _KINDS else None


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        if at + _HEAD.size > len(data):
            raise ValueError("a record has no head")
        op, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if at + length > len(data):
            raise ValueError("a record ends too late")
        yield op, data[at : at + length]
        at += length


def _unpacked(chunk: records.Chunk) -> bytes:
    data = decompress(chunk.data, chunk.compression, chunk.uncompressed_size)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("the checksum is wrong")
    return data
