"""The fields of MCAP's records: numbers, strings and maps, to bytes and back; little endian."""

from __future__ import annotations

from collections.abc import Mapping
from struct import Struct

U16, U32, U64 = Struct("<H"), Struct("<I"), Struct("<Q")
_COUNT_ENTRY = Struct("<HQ")


def text(value: str) -> bytes:
    """Return a string, preceded by its length."""
    data = value.encode()
    return U32.pack(len(data)) + data


def text_map(values: Mapping[str, str]) -> bytes:
    """Return a map of strings, preceded by its length in bytes."""
    data = b"".join(text(key) + text(value) for key, value in values.items())
    return U32.pack(len(data)) + data


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
        return int(U16.unpack(self.take(2))[0])

    def u32(self) -> int:
        """Return a number of 4 bytes."""
        return int(U32.unpack(self.take(4))[0])

    def u64(self) -> int:
        """Return a number of 8 bytes."""
        return int(U64.unpack(self.take(8))[0])

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
    return U32.pack(_COUNT_ENTRY.size * len(values)) + b"".join(
        _COUNT_ENTRY.pack(key, value) for key, value in values.items()
    )
