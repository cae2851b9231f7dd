"""Reads MCAP files: by their summary, or by looking through them where it is missing or wrong."""

from __future__ import annotations

import heapq
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from twin.bridge.bags.compression import decompress
from twin.bridge.bags.mcap.fields import Fields
from twin.bridge.bags.mcap.records import (
    FOOTER_SIZE,
    MAGIC,
    RECORD_HEAD,
    Attachment,
    Channel,
    ChunkHead,
    ChunkIndex,
    Message,
    Op,
    Schema,
    Statistics,
)
from twin.errors import RecordingError
from twin.files.reading import open_file

_LARGEST_RECORD = 1 << 32


class _Block(NamedTuple):
    """A chunk, or a message outside of chunks, in the file."""

    start_ns: int
    end_ns: int
    offset: int
    length: int


class McapReader:
    """An open file; `damage` says what is wrong with it, everything else is what could be read."""

    def __init__(self, path: Path) -> None:
        """Open a file and read its summary, or everything if there is none.

        Raises:
            RecordingError: not an MCAP file, or it cannot be read.
        """
        self.path = path
        self.profile = ""
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: Counter[int] = Counter()
        """Messages by channel."""
        self.start_ns, self.end_ns = 0, 0
        """Log time of the first and the last message [ns]."""
        self.metadata: dict[str, dict[str, str]] = {}
        """By name; of several of a name the last."""
        self.damage = ""
        """Empty, or one clause such as 'ends in the middle of a chunk'."""
        self._blocks: list[_Block] = []
        self._attachments: dict[str, tuple[int, int]] = {}
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

    def messages(
        self, channels: set[int] | None = None, start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[Message]:
        """Yield messages by log time, from `start_ns` to `end_ns` [ns] inclusive; equal times as in the file.

        Raises:
            RecordingError: a chunk is damaged.
        """
        first = self.start_ns if start_ns is None else start_ns
        last = self.end_ns if end_ns is None else end_ns
        blocks = [b for b in self._blocks if b.start_ns <= last and b.end_ns >= first]
        blocks.sort(key=lambda block: (block.start_ns, block.offset))
        waiting: list[tuple[int, int, int, Message]] = []
        for block in blocks:
            # Nothing in this or a later block is earlier than its start.
            while waiting and waiting[0][0] < block.start_ns:
                yield heapq.heappop(waiting)[3]
            for number, message in enumerate(self._block(block)):
                if (channels is None or message.channel_id in channels) and first <= message.log_ns <= last:
                    heapq.heappush(waiting, (message.log_ns, block.offset, number, message))
        while waiting:
            yield heapq.heappop(waiting)[3]

    def attachment(self, name: str) -> Attachment | None:
        """Return the last attachment of that name, None if there is none."""
        if name not in self._attachments:
            return None
        offset, length = self._attachments[name]
        return Attachment.parse(self._read(offset + RECORD_HEAD.size, length - RECORD_HEAD.size))

    def close(self) -> None:
        """Close the file. Harmless when repeated."""
        self._file.close()

    def _open(self) -> None:
        head = self._read(0, min(len(MAGIC) + RECORD_HEAD.size, self._size))
        if not head:
            raise RecordingError(f"{self.path}: is empty")
        if not head.startswith(MAGIC[: len(head)]):
            raise RecordingError(f"{self.path}: is not an MCAP file")
        try:
            self._read_summary()
            return
        except (ValueError, UnicodeDecodeError) as fault:
            self.damage = str(fault)
        for state in (self.schemas, self.channels, self.counts, self.metadata, self._attachments):
            state.clear()
        self._blocks.clear()
        self._scan()

    def _read_summary(self) -> None:
        """Read the summary; raises ValueError if there is none that can be trusted."""
        if self._size < len(MAGIC) + FOOTER_SIZE + len(MAGIC):
            raise ValueError("ends too early")
        end = self._size - len(MAGIC) - FOOTER_SIZE
        tail = self._read(end, FOOTER_SIZE + len(MAGIC))
        if not tail.endswith(MAGIC):
            raise ValueError("ends in the middle: its writer was stopped")
        f = Fields(tail[RECORD_HEAD.size :])
        start, _, crc = f.u64(), f.u64(), f.u32()
        if start == 0:
            raise ValueError("")  # allowed
        if start > end:
            raise ValueError("has a damaged footer")
        summary = self._read(start, end - start)
        if crc and zlib.crc32(summary + tail[: FOOTER_SIZE - 4]) != crc:
            raise ValueError("has a damaged summary")
        statistics = None
        self._profile()
        for op, content in _records(summary):
            if op == Op.SCHEMA:
                self._add_schema(content)
            elif op == Op.CHANNEL:
                self._add_channel(content)
            elif op == Op.CHUNK_INDEX:
                index = ChunkIndex.parse(content)
                self._blocks.append(_Block(index.start_ns, index.end_ns, index.offset, index.length))
            elif op == Op.STATISTICS:
                statistics = Statistics.parse(content)
            elif op == Op.METADATA_INDEX:
                f = Fields(content)
                offset, length = f.u64(), f.u64()
                self._add_metadata(self._read(offset + RECORD_HEAD.size, length - RECORD_HEAD.size))
            elif op == Op.ATTACHMENT_INDEX:
                f = Fields(content)
                offset, length, _ = f.u64(), f.u64(), f.take(24)
                self._attachments[f.text()] = (offset, length)
        if (
            statistics is None
            or len(self._blocks) != statistics.chunks
            or len(self.channels) != statistics.channels
        ):
            raise ValueError("has an incomplete summary")
        if statistics.messages and not self._blocks:
            raise ValueError("")  # written without chunks: no damage, but no index either
        self.counts.update(statistics.by_channel)
        self.start_ns, self.end_ns = statistics.start_ns, statistics.end_ns

    def _profile(self) -> None:
        op, length = RECORD_HEAD.unpack(self._read(len(MAGIC), RECORD_HEAD.size))
        if op == Op.HEADER and length < 1 << 16:
            self.profile = Fields(self._read(len(MAGIC) + RECORD_HEAD.size, length)).text()

    def _scan(self) -> None:
        """Look through the records up to the first that is not whole."""
        at = len(MAGIC)
        times: list[int] = []
        while at + RECORD_HEAD.size <= self._size:
            op, length = RECORD_HEAD.unpack(self._read(at, RECORD_HEAD.size))
            whole = RECORD_HEAD.size + length
            if op == Op.DATA_END or op == Op.FOOTER:
                break
            if at + whole > self._size or length > _LARGEST_RECORD:
                self.damage = self.damage or "ends in the middle"
                break
            try:
                self._scan_record(op, at, whole, times)
            except (ValueError, UnicodeDecodeError) as fault:
                self.damage = f"is damaged at byte {at}: {fault}"
                break
            at += whole
        if times:
            self.start_ns, self.end_ns = min(times), max(times)

    def _scan_record(self, op: int, at: int, whole: int, times: list[int]) -> None:
        if op in (Op.MESSAGE_INDEX, Op.ATTACHMENT):
            if op == Op.ATTACHMENT:
                attachment = Attachment.parse(self._read(at + RECORD_HEAD.size, whole - RECORD_HEAD.size))
                self._attachments[attachment.name] = (at, whole)
            return
        content = self._read(at + RECORD_HEAD.size, whole - RECORD_HEAD.size)
        if op == Op.HEADER:
            self.profile = Fields(content).text()
        elif op == Op.CHUNK:
            head = ChunkHead.parse(content)
            for inner, data in _records(_unpacked(head)):
                self._scan_content(inner, data, times)
            self._blocks.append(_Block(head.start_ns, head.end_ns, at, whole))
        elif op == Op.METADATA:
            self._add_metadata(content)
        else:
            self._scan_content(op, content, times)
            if op == Op.MESSAGE:
                self._blocks.append(_Block(times[-1], times[-1], at, whole))

    def _scan_content(self, op: int, content: bytes, times: list[int]) -> None:
        if op == Op.SCHEMA:
            self._add_schema(content)
        elif op == Op.CHANNEL:
            self._add_channel(content)
        elif op == Op.MESSAGE:
            message = Message.parse(content)
            self.counts[message.channel_id] += 1
            times.append(message.log_ns)

    def _add_schema(self, content: bytes) -> None:
        schema = Schema.parse(content)
        self.schemas[schema.id] = schema

    def _add_channel(self, content: bytes) -> None:
        channel = Channel.parse(content)
        self.channels[channel.id] = channel

    def _add_metadata(self, content: bytes) -> None:
        f = Fields(content)
        name = f.text()
        self.metadata[name] = f.text_map()

    def _block(self, block: _Block) -> Iterator[Message]:
        op, _ = RECORD_HEAD.unpack(self._read(block.offset, RECORD_HEAD.size))
        content = self._read(block.offset + RECORD_HEAD.size, block.length - RECORD_HEAD.size)
        try:
            if op == Op.MESSAGE:
                yield Message.parse(content)
                return
            for inner, data in _records(_unpacked(ChunkHead.parse(content))):
                if inner == Op.MESSAGE:
                    yield Message.parse(data)
        except ValueError as fault:
            raise RecordingError(
                f"{self.path}: the chunk at byte {block.offset} is damaged: {fault}"
            ) from fault

    def _read(self, offset: int, size: int) -> bytes:
        try:
            self._file.seek(offset)
            data = self._file.read(size)
        except (OSError, OverflowError) as fault:
            raise RecordingError(f"{self.path}: cannot be read: {fault}") from fault
        if len(data) != size:
            raise ValueError("ends too early")
        return data


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        if at + RECORD_HEAD.size > len(data):
            raise ValueError("a record has no head")
        op, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size
        if at + length > len(data):
            raise ValueError("a record ends too late")
        yield op, data[at : at + length]
        at += length


def _unpacked(head: ChunkHead) -> bytes:
    data = decompress(head.packed, head.compression, head.size)
    if head.crc and zlib.crc32(data) != head.crc:
        raise ValueError("the checksum is wrong")
    return data
