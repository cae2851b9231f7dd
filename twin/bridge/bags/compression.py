"""Compression of chunks and messages: what MCAP names '', 'zstd' and 'lz4'."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from itertools import islice
from typing import BinaryIO, Literal, TypeVar, cast, get_args

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from twin.errors import RecordingError, nearest

Compression = Literal["none", "zstd", "lz4"]
"""How a bag is compressed."""
COMPRESSIONS: tuple[Compression, ...] = get_args(Compression)
_PIECE = 1 << 20
"""What a library takes memory for at once, whatever a file says of its size."""


Choice = TypeVar("Choice", bound=str)


def one_of(valid: Sequence[Choice], name: str, what: str) -> Choice:
    """Return the valid word that a name is.

    Raises:
        RecordingError: it is none.
    """
    for word in valid:
        if word == name:
            return word
    raise RecordingError(f"{name!r} is no {what}; {nearest(name, valid)}")


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
