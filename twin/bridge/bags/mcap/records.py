"""The records of an MCAP file, to bytes and back.

Source: https://mcap.dev/spec. Little endian; a record is an opcode u8, a length u64 and its content.
"""

from __future__ import annotations

import zlib
from enum import IntEnum
from struct import Struct
from typing import NamedTuple

from twin.bridge.bags.mcap.fields import U16, U32, U64, Fields, numbers, text, text_map

MAGIC = b"\x89MCAP0\r\n"
"""At the start and at the end of a file."""
RECORD_HEAD = Struct("<BQ")
"""Opcode and length of a record."""
FOOTER_SIZE = RECORD_HEAD.size + 20

_MESSAGE = Struct("<HIQQ")
_INDEX_ENTRY = Struct("<QQ")
_STATISTICS = Struct("<QHIIIIQQ")


class Op(IntEnum):
    """Opcodes."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def record(op: Op, *parts: bytes) -> bytes:
    """Return a record of the given content."""
    content = b"".join(parts)
    return RECORD_HEAD.pack(op, len(content)) + content


class Schema(NamedTuple):
    """The definition of a message type."""

    id: int
    """From 1."""
    name: str
    encoding: str
    """ros2msg, ros2idl or empty."""
    data: bytes

    def pack(self) -> bytes:
        """Return the record."""
        head = U16.pack(self.id) + text(self.name) + text(self.encoding)
        return record(Op.SCHEMA, head, U32.pack(len(self.data)), self.data)

    @classmethod
    def parse(cls, data: bytes) -> Schema:
        """Read the record's content."""
        f = Fields(data)
        return cls(f.u16(), f.text(), f.text(), f.take(f.u32()))


class Channel(NamedTuple):
    """A topic."""

    id: int
    schema_id: int
    topic: str
    message_encoding: str
    metadata: dict[str, str]

    def pack(self) -> bytes:
        """Return the record."""
        ids = U16.pack(self.id) + U16.pack(self.schema_id)
        return record(Op.CHANNEL, ids, text(self.topic), text(self.message_encoding), text_map(self.metadata))

    @classmethod
    def parse(cls, data: bytes) -> Channel:
        """Read the record's content."""
        f = Fields(data)
        return cls(f.u16(), f.u16(), f.text(), f.text(), f.text_map())


class Message(NamedTuple):
    """A message."""

    channel_id: int
    sequence: int
    log_ns: int
    publish_ns: int
    data: bytes

    def pack(self) -> bytes:
        """Return the record."""
        return record(Op.MESSAGE, _MESSAGE.pack(*self[:4]), self.data)

    @classmethod
    def parse(cls, data: bytes) -> Message:
        """Read the record's content."""
        if len(data) < _MESSAGE.size:
            raise ValueError("a message record is too short")
        channel_id, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(data)
        return cls(channel_id, sequence, log_ns, publish_ns, data[_MESSAGE.size :])


class ChunkHead(NamedTuple):
    """What a chunk says of itself before its records."""

    start_ns: int
    end_ns: int
    size: int
    """Uncompressed [bytes]."""
    crc: int
    compression: str
    packed: bytes
    """The records, compressed."""

    def pack(self) -> bytes:
        """Return the record."""
        head = U64.pack(self.start_ns) + U64.pack(self.end_ns) + U64.pack(self.size) + U32.pack(self.crc)
        return record(Op.CHUNK, head, text(self.compression), U64.pack(len(self.packed)), self.packed)

    @classmethod
    def parse(cls, data: bytes) -> ChunkHead:
        """Read the record's content."""
        f = Fields(data)
        return cls(f.u64(), f.u64(), f.u64(), f.u32(), f.text(), f.take(f.u64()))


def message_index(channel_id: int, entries: list[tuple[int, int]]) -> bytes:
    """Return the record with (log time, offset in the uncompressed chunk) of a channel's messages."""
    packed = b"".join(_INDEX_ENTRY.pack(*entry) for entry in entries)
    return record(Op.MESSAGE_INDEX, U16.pack(channel_id), U32.pack(len(packed)), packed)


class ChunkIndex(NamedTuple):
    """Where a chunk is."""

    start_ns: int
    end_ns: int
    offset: int
    length: int
    """Of the chunk's record with its head [bytes]."""
    message_indexes: dict[int, int]
    """Channel -> where its message index is."""
    indexes_length: int
    compression: str
    packed_size: int
    size: int

    def pack(self) -> bytes:
        """Return the record."""
        head = b"".join(map(U64.pack, (self.start_ns, self.end_ns, self.offset, self.length)))
        tail = U64.pack(self.packed_size) + U64.pack(self.size)
        indexes = numbers(self.message_indexes) + U64.pack(self.indexes_length)
        return record(Op.CHUNK_INDEX, head, indexes, text(self.compression), tail)

    @classmethod
    def parse(cls, data: bytes) -> ChunkIndex:
        """Read the record's content."""
        f = Fields(data)
        return cls(f.u64(), f.u64(), f.u64(), f.u64(), f.numbers(), f.u64(), f.text(), f.u64(), f.u64())


class Statistics(NamedTuple):
    """Totals of a file."""

    messages: int
    schemas: int
    channels: int
    attachments: int
    metadata: int
    chunks: int
    start_ns: int
    end_ns: int
    by_channel: dict[int, int]

    def pack(self) -> bytes:
        """Return the record."""
        return record(Op.STATISTICS, _STATISTICS.pack(*self[:8]), numbers(self.by_channel))

    @classmethod
    def parse(cls, data: bytes) -> Statistics:
        """Read the record's content."""
        f = Fields(data)
        return cls(f.u64(), f.u16(), f.u32(), f.u32(), f.u32(), f.u32(), f.u64(), f.u64(), f.numbers())


class Attachment(NamedTuple):
    """A file within the file."""

    log_ns: int
    name: str
    media_type: str
    data: bytes

    def pack(self) -> bytes:
        """Return the record."""
        times = U64.pack(self.log_ns) + U64.pack(self.log_ns)
        content = times + text(self.name) + text(self.media_type) + U64.pack(len(self.data)) + self.data
        return record(Op.ATTACHMENT, content, U32.pack(zlib.crc32(content)))

    @classmethod
    def parse(cls, data: bytes) -> Attachment:
        """Read the record's content."""
        f = Fields(data)
        log_ns, _ = f.u64(), f.u64()
        return cls(log_ns, f.text(), f.text(), f.take(f.u64()))

    def index_record(self, offset: int, length: int) -> bytes:
        """Return the index record of this attachment, which is at `offset`."""
        numbers_ = (offset, length, self.log_ns, self.log_ns, len(self.data))
        return record(Op.ATTACHMENT_INDEX, *map(U64.pack, numbers_), text(self.name), text(self.media_type))


def metadata_index(offset: int, length: int, name: str) -> bytes:
    """Return the index record of a metadata record."""
    return record(Op.METADATA_INDEX, U64.pack(offset), U64.pack(length), text(name))


def summary_offset(group: Op, start: int, length: int) -> bytes:
    """Return the record that says where the summary's records of one kind are."""
    return record(Op.SUMMARY_OFFSET, bytes([group]), U64.pack(start), U64.pack(length))


def footer(summary: bytes, summary_start: int, offsets_start: int) -> bytes:
    """Return the record that ends a file, before the magic; its CRC covers the summary and itself."""
    head = RECORD_HEAD.pack(Op.FOOTER, 20) + U64.pack(summary_start) + U64.pack(offsets_start)
    return head + U32.pack(zlib.crc32(summary + head))
