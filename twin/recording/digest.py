"""One number that tells whether two runs were the same run."""

from __future__ import annotations

import hashlib
import struct
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

_HEAD = struct.Struct("<qI")  # time [ns], payload length [bytes]
_AT_ONCE = 64
"""Samples that are encoded and hashed in one go: one by one, between other work, that costs more."""


class RunDigest:
    """SHA-256 over every published sample, in order, and the final physics state.

    Each sample adds its topic and type (each ended by a zero byte, which ROS names cannot contain), its time,
    the length of its payload and the payload: two different sequences of samples are never the same bytes.
    """

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self._names: dict[tuple[str, str], bytes] = {}
        self._waiting: list[Sample[Any]] = []

    def on_sample(self, sample: Sample[Any]) -> None:
        """Add one sample (a callback for `Bus.tap`)."""
        self._waiting.append(sample)
        if len(self._waiting) >= _AT_ONCE:
            self._add()

    def _add(self) -> None:
        parts: list[bytes] = []
        for sample in self._waiting:
            key = (sample.topic, sample.msgtype)
            names = self._names.get(key)
            if names is None:
                names = self._names[key] = f"{sample.topic}\0{sample.msgtype}\0".encode()
            payload = sample.payload
            parts += (names, _HEAD.pack(sample.time_ns, len(payload)), payload)
        self._hash.update(b"".join(parts))
        self._waiting.clear()

    def finish(self, state: bytes) -> str:
        """Return the digest as hexadecimal text; `state` is the final physics state."""
        self._add()
        whole = self._hash.copy()
        whole.update(b"\0state\0" + state)
        return whole.hexdigest()
