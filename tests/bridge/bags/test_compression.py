"""What a chunk says of its size is held against what is in it, before memory is taken."""

from __future__ import annotations

import os

import lz4.frame
import pytest
import zstandard

from twin.bridge.bags.compression import decompress

COMPRESS = {"": bytes, "zstd": zstandard.ZstdCompressor().compress, "lz4": lz4.frame.compress}
DATA = os.urandom(1000) + bytes(2_500_000)


@pytest.mark.parametrize("name", COMPRESS)
def test_there_and_back(name: str) -> None:
    assert decompress(COMPRESS[name](DATA), name, len(DATA)) == DATA


@pytest.mark.parametrize("name", COMPRESS)
@pytest.mark.parametrize("size", [0, 999, 1 << 20, len(DATA) - 1, len(DATA) + 1, 1 << 40, (1 << 64) - 1])
def test_another_size_is_refused(name: str, size: int) -> None:
    with pytest.raises(ValueError, match=f"does not have {size} bytes"):
        decompress(COMPRESS[name](DATA), name, size)


@pytest.mark.parametrize("name", ["zstd", "lz4"])
@pytest.mark.parametrize("rest", [slice(-9), slice(20), slice(0), slice(9, None)])
def test_what_is_cut_off_is_refused(name: str, rest: slice) -> None:
    with pytest.raises(ValueError, match=r"^zstd|^lz4|does not have"):
        decompress(COMPRESS[name](DATA)[rest], name, len(DATA))


def test_an_unknown_compression_is_named() -> None:
    with pytest.raises(ValueError, match="the compression 'lzma' is not known"):
        decompress(b"", "lzma", 0)
