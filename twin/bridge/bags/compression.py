"""Compression of chunks: what MCAP names '', 'zstd' and 'lz4'."""

from __future__ import annotations

import sys
from typing import Any, Literal, cast, get_args

from twin.errors import RecordingError, nearest

Compression = Literal["none", "zstd", "lz4"]
"""How chunks are compressed."""


def as_compression(name: str) -> Compression:
    """Return the compression of that name.

    Raises:
        RecordingError: there is none.
    """
    if name not in get_args(Compression):
        raise RecordingError(f"{name!r} is no compression; {nearest(name, get_args(Compression))}")
    return cast(Compression, name)


def mcap_name(compression: Compression) -> str:
    """Return the name that MCAP files use."""
    return "" if compression == "none" else compression


def compress(data: bytes, name: str) -> bytes:
    """Compress with what MCAP names so."""
    if name == "zstd":
        return bytes(_zstd().compress(data))
    if name == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        return bytes(lz4.frame.compress(data))
    return data


def decompress(data: bytes, name: str, size: int) -> bytes:
    """Undo `compress`.

    Raises:
        ValueError: an unknown name, damaged data, or not `size` bytes; never more than that are made.
    """
    if name == "zstd":
        zstd = _zstd()
        try:
            data = zstd.ZstdDecompressor().decompress(data, max_length=size + 1)
        except (zstd.ZstdError, OverflowError) as error:
            raise ValueError(f"zstd: {error}") from error
    elif name == "lz4":
        import lz4.frame

        try:
            data = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        except (RuntimeError, OverflowError) as error:
            raise ValueError(f"lz4: {error}") from error
    elif name:
        raise ValueError(f"the compression {name!r} is not known")
    if len(data) != size:
        raise ValueError(f"{len(data)} bytes or more instead of {size}")
    return data


def _zstd() -> Any:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd
