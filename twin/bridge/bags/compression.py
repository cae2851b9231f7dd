"""Compression of chunks and messages: what MCAP names '', 'zstd' and 'lz4'."""

from __future__ import annotations

from io import BytesIO
from itertools import islice
from typing import BinaryIO, Literal, cast, get_args

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from twin.errors import RecordingError, nearest

Compression = Literal["none", "zstd", "lz4"]
"""How a bag is compressed."""
_PIECE = 1 << 20
"""What a library takes memory for at once, whatever a file says of its size."""


def as_compression(name: str) -> Compression:
    """Return the compression of that name.

    Raises:
        RecordingError: there is none.
    """
    if name not in get_args(Compression):
        raise RecordingError(f"{name!r} is no compression; {nearest(name, get_args(Compression))}")
    return cast(Compression, name)


def decompress(data: bytes, name: str, size: int) -> bytes:
    """Return what was compressed with what MCAP names so.

    Raises:
        ValueError: an unknown name, damaged data, or not `size` bytes; not much more than that are made.
    """
    if name:
        try:
            with _reader(data, name) as stream:
                pieces = iter(lambda: stream.read(_PIECE), b"")
                data = b"".join(islice(pieces, size // _PIECE + 1))
        except (zstandard.ZstdError, RuntimeError, EOFError) as error:
            raise ValueError(f"{name}: {error}") from error
    if len(data) != size:
        raise ValueError(f"it does not have {size} bytes")
    return data


def _reader(data: bytes, name: str) -> BinaryIO:
    if name == "zstd":
        return zstandard.ZstdDecompressor().stream_reader(data)
    if name == "lz4":
        return cast(BinaryIO, lz4.frame.LZ4FrameFile(BytesIO(data)))
    raise ValueError(f"the compression {name!r} is not known")
