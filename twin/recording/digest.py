"""One number that tells whether two runs were the same run, and many small ones that tell where they part."""

from __future__ import annotations

import hashlib
import struct
from typing import TYPE_CHECKING, Any

from xxhash import xxh3_64_intdigest

from twin.recording.hashes import PERIOD_NS, RunHashes

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

_HEAD = struct.Struct("<qI")  # time [ns], payload length [bytes]
_AT_ONCE = 64
"""Samples that are encoded and hashed in one go: one by one, between other work, that costs more."""
_SHORT = 0xFFFFFFFF


class RunDigest:
    """SHA-256 over every published sample, in order, and the final physics state.

    Each sample adds its topic and type (each ended by a zero byte, which ROS names cannot contain), its time,
    the length of its payload and the payload: two different sequences of samples are never the same bytes.
    Beside it each topic has a short hash for each second. What is published on demand does not count: to be
    heard changes no run.
    """

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self._topics: dict[tuple[str, str], _Topic] = {}
        self._waiting: list[Sample[Any]] = []
        self.stream: list[int] = []
        """`RunHashes.stream`, of the seconds that have ended."""
        self.physics: list[int] = []
        """`RunHashes.physics`, of the same."""
        self.second_ends_ns = PERIOD_NS
        """When `end_second` is to be called, after the tick that reaches it [ns]."""

    def on_sample(self, sample: Sample[Any]) -> None:
        """Add one sample (a callback for `Bus.tap`)."""
        if sample.publisher.on_demand:
            return
        self._waiting.append(sample)
        if len(self._waiting) >= _AT_ONCE:
            self._add()

    def _add(self) -> None:
        parts: list[bytes] = []
        for sample in self._waiting:
            key = (sample.topic, sample.msgtype)
            topic = self._topics.get(key)
            if topic is None:
                topic = self._topics[key] = _Topic(f"{sample.topic}\0{sample.msgtype}\0".encode())
            payload, time_ns = sample.payload, sample.time_ns
            parts += (topic.names, _HEAD.pack(time_ns, len(payload)), payload)
            topic.folded = xxh3_64_intdigest(payload, topic.folded ^ time_ns)
        self._hash.update(b"".join(parts))
        self._waiting.clear()

    def end_second(self, state: bytes) -> None:
        """Note the hashes of a second; `state` is the physics state at its end."""
        self._add()
        second = len(self.stream)
        for topic in self._topics.values():
            if topic.folded:
                topic.seconds[second] = topic.folded & _SHORT
                topic.folded = 0
        self.stream.append(int.from_bytes(self._hash.digest()[:4], "little"))
        self.physics.append(int.from_bytes(state[:4], "little"))
        self.second_ends_ns += PERIOD_NS

    def hashes(self, state: bytes) -> RunHashes:
        """Return the hashes of all seconds; `state` is the physics state now. Nothing is added afterwards."""
        self._add()
        if any(topic.folded for topic in self._topics.values()):  # of a second that did not end
            self.end_second(state)
        return RunHashes(
            stream=tuple(self.stream),
            physics=tuple(self.physics),
            topics={" ".join(key): dict(topic.seconds) for key, topic in sorted(self._topics.items())},
        )

    def finish(self, state: bytes) -> str:
        """Return the digest as hexadecimal text; `state` is the final physics state."""
        self._add()
        whole = self._hash.copy()
        whole.update(b"\0state\0" + state)
        return whole.hexdigest()


class _Topic:
    __slots__ = ("folded", "names", "seconds")

    def __init__(self, names: bytes) -> None:
        self.names = names
        self.folded = 0
        """Hash of what was published in this second; each sample's seed is what was before it."""
        self.seconds: dict[int, int] = {}
