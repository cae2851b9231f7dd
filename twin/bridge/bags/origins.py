"""Which node published each message of a run: an attachment of the bag, which other readers do not mind.

A run is deterministic because its nodes run one after the other; to run one of them again alike, the replay
must know between which messages its turn was, and which messages were its own.
"""

from __future__ import annotations

import json
import zlib
from array import array
from dataclasses import dataclass

import numpy as np

NAME, MEDIA_TYPE = "twin/origins", "application/x-twin-origins"


@dataclass(frozen=True)
class Origins:
    """The nodes of a run and what they published."""

    nodes: tuple[str, ...]
    """Full names, in the order in which they run; the first, empty, is who is outside: served before them."""
    of_message: array[int]
    """Per message of the bag, in its order: index into `nodes`."""

    def pack(self) -> bytes:
        """Return the attachment: one line of JSON, then 16 bits per message, little endian, deflated."""
        numbers = np.asarray(self.of_message, "<u2").tobytes()
        return json.dumps(self.nodes).encode() + b"\n" + zlib.compress(numbers)

    @classmethod
    def parse(cls, data: bytes) -> Origins:
        """Read the attachment.

        Raises:
            ValueError: it is not one.
        """
        head, _, packed = data.partition(b"\n")
        try:
            numbers = np.frombuffer(zlib.decompress(packed), "<u2")
        except zlib.error as fault:
            raise ValueError(str(fault)) from fault
        return cls(tuple(json.loads(head)), array("H", numbers.tolist()))
