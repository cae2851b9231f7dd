"""Short hashes of a run per topic and second: from them alone two runs can be compared, to the second."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

HASHES = "hashes.json"
"""The file of a run's folder that has them."""
PERIOD_NS = 1_000_000_000
"""What one hash covers [ns] of simulated time."""


@dataclass(frozen=True, kw_only=True)
class RunHashes:
    """Hashes of 32 bits; the second k covers the ticks that end after k and until k + 1 s."""

    stream: tuple[int, ...]
    """Of all samples from the start to the end of each second, in order."""
    physics: tuple[int, ...]
    """Of the physics state at the end of each second."""
    topics: Mapping[str, Mapping[int, int]]
    """Of the samples of one second, by topic and type (`/scan sensor_msgs/msg/LaserScan`) and second.

    Seconds without a sample have none.
    """

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: of each topic the little-endian words, in base64, 0 for no sample."""
        seconds = range(len(self.stream))
        return {
            "stream": _packed(self.stream),
            "physics": _packed(self.physics),
            "topics": {
                name: _packed([found.get(second, 0) for second in seconds])
                for name, found in self.topics.items()
            },
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return what `to_dict` wrote.

        Raises:
            ValueError: It did not write that.
        """
        try:
            return cls(
                stream=tuple(_unpacked(values["stream"])),
                physics=tuple(_unpacked(values["physics"])),
                topics={
                    str(name): {second: word for second, word in enumerate(_unpacked(text)) if word}
                    for name, text in values["topics"].items()
                },
            )
        except (KeyError, TypeError, AttributeError, binascii.Error) as fault:
            raise ValueError(f"not the hashes of a run: {fault!r}") from None


def _packed(words: Sequence[int]) -> str:
    return base64.b64encode(b"".join(word.to_bytes(4, "little") for word in words)).decode()


def _unpacked(text: str) -> list[int]:
    content = base64.b64decode(text, validate=True)
    return [int.from_bytes(content[i : i + 4], "little") for i in range(0, len(content), 4)]
