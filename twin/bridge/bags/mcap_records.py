"""The records of an MCAP file, to bytes and back.

Source: https://mcap.dev/spec. Little endian; a record is an opcode u8, a length u64 and its content.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from enum import IntEnum
from struct import Struct
from typing import NamedTuple

MAGIC = b"\x89MCAP0\r\n"
"""At the start and at the end of a file."""
RECORD_HEAD = Struct("<BQ")
"""Opcode and length of a record."""
FOOTER_SIZE = RECORD_HEAD.size + 20

_U16, _U32, _U64 = Struct("<H"), Struct("<I"), Struct("<Q")
_MESSAGE = Struct("<HIQQ")
_INDEX_ENTRY = Struct("<QQ")
_COUNT_ENTRY = Struct("<HQ")
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


def text(value: str) -> bytes:
    """Return a string, preceded by its length."""
    data = value.encode()
    return _U32.pack(len(data)) + data


def text_map(values: Mapping[str, str]) -> bytes:
    """Return a map of strings, preceded by its length in bytes."""
    data = b"".join(text(key) + text(value) for key, value in values.items())
    return _U32.pack(len(data)) + data


class Fields:
    """Reads the fields of a record one after the other; raises ValueError where they end too early."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def take(self, size: int) -> bytes:
        """Return the next `size` bytes."""
        end = self._at + size
        if end > len(self._data):
            raise ValueError(f"a record ends {end - len(self._data)} bytes too early")
        self._at, start = end, self._at
        return self._data[start:end]

    def u16(self) -> int:
        """Return a number of 2 bytes."""
        return int(_U16.unpack(self.take(2))[0])

    def u32(self) -> int:
        """Return a number of 4 bytes."""
        return int(_U32.unpack(self.take(4))[0])

    def u64(self) -> int:
        """Return a number of 8 bytes."""
        return int(_U64.unpack(self.take(8))[0])

    def text(self) -> str:
        """Return a string."""
        return self.take(self.u32()).decode()

    def text_map(self) -> dict[str, str]:
        """Return a map of strings."""
        inner = Fields(self.take(self.u32()))
        found = {}
        while inner.more:
            key = inner.text()
            found[key] = inner.text()
        return found

    def numbers(self) -> dict[int, int]:
        """Return a map of u16 to u64."""
        return dict(_COUNT_ENTRY.iter_unpack(self.take(self.u32())))

    @property
    def more(self) -> bool:
        """Whether something is left."""
        return self._at < len(self._data)


def numbers(values: Mapping[int, int]) -> bytes:
    """Return a map of u16 to u64, preceded by its length in bytes."""
    return _U32.pack(_COUNT_ENTRY.size * len(values)) + b"".join(
        _COUNT_ENTRY.pack(key, value) for key, value in values.items()
    )


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
        head = _U16.pack(self.id) + text(self.name) + text(self.encoding)
        return record(Op.SCHEMA, head, _U32.pack(len(self.data)), self.data)

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
        ids = _U16.pack(self.id) + _U16.pack(self.schema_id)
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
        head = _U64.pack(self.start_ns) + _U64.pack(self.end_ns) + _U64.pack(self.size) + _U32.pack(self.crc)
        return record(Op.CHUNK, head, text(self.compression), _U64.pack(len(self.packed)), self.packed)

    @classmethod
    def parse(cls, data: bytes) -> ChunkHead:
        """Read the record's content."""
        f = Fields(data)
        return cls(f.u64(), f.u64(), f.u64(), f.u32(), f.text(), f.take(f.u64()))


def message_index(channel_id: int, entries: list[tuple[int, int]]) -> bytes:
    """Return the record with (log time, offset in the uncompressed chunk) of a channel's messages."""
    packed = b"".join(_INDEX_ENTRY.pack(*entry) for entry in entries)
    return record(Op.MESSAGE_INDEX, _U16.pack(channel_id), _U32.pack(len(packed)), packed)


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
        head = b"".join(map(_U64.pack, (self.start_ns, self.end_ns, self.offset, self.length)))
        tail = _U64.pack(self.packed_size) + _U64.pack(self.size)
        indexes = numbers(self.message_indexes) + _U64.pack(self.indexes_length)
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
        times = _U64.pack(self.log_ns) + _U64.pack(self.log_ns)
        content = times + text(self.name) + text(self.media_type) + _U64.pack(len(self.data)) + self.data
        return record(Op.ATTACHMENT, content, _U32.pack(zlib.crc32(content)))

    @classmethod
    def parse(cls, data: bytes) -> Attachment:
        """Read the record's content."""
        f = Fields(data)
        log_ns, _ = f.u64(), f.u64()
        return cls(log_ns, f.text(), f.text(), f.take(f.u64()))

    def index_record(self, offset: int, length: int) -> bytes:
        """Return the index record of this attachment, which is at `offset`."""
        numbers_ = (offset, length, self.log_ns, self.log_ns, len(self.data))
        return record(Op.ATTACHMENT_INDEX, *map(_U64.pack, numbers_), text(self.name), text(self.media_type))


def metadata_index(offset: int, length: int, name: str) -> bytes:
    """Return the index record of a metadata record."""
    return record(Op.METADATA_INDEX, _U64.pack(offset), _U64.pack(length), text(name))


def summary_offset(group: Op, start: int, length: int) -> bytes:
    """Return the record that says where the summary's records of one kind are."""
    return record(Op.SUMMARY_OFFSET, bytes([group]), _U64.pack(start), _U64.pack(length))


def footer(summary: bytes, summary_start: int, offsets_start: int) -> bytes:
    """Return the record that ends a file, before the magic; its CRC covers the summary and itself."""
    head = RECORD_HEAD.pack(Op.FOOTER, 20) + _U64.pack(summary_start) + _U64.pack(offsets_start)
    return head + _U32.pack(zlib.crc32(summary + head))
