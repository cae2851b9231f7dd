"""Random numbers that depend on the seed, the part's name and the tick, and on nothing else."""

from __future__ import annotations

import hashlib
from typing import Any, ClassVar

import numpy as np

from twin.geometry import Array

_NORMAL, _UNIFORM = 0, 1


class NoiseStream:
    """A counter-based stream (Philox 4x64, Salmon et al. 2011): key from seed and name, counter from tick.

    The numbers of a tick do not depend on how often, or whether, other ticks were drawn, nor on other
    streams: adding a sensor changes no other sensor's noise.
    """

    branch: ClassVar[int] = 0
    """Which of several futures this process is, if it was forked for one: each has numbers of its own."""

    def __init__(self, seed: int, name: str) -> None:
        """Derive the key; `seed` is any integer, `name` unique in a run."""
        digest = hashlib.blake2b(f"{seed}\0{name}".encode(), digest_size=16).digest()
        bits = np.random.Philox(key=np.frombuffer(digest, dtype=np.uint64))
        self._generator = np.random.Generator(bits)
        self._bits = bits
        # Of plain numbers: numpy reads them three times as fast as arrays.
        start = bits.state
        self._words = {"counter": (0, 0, 0, 0), "key": tuple(start["state"]["key"].tolist())}
        self._start: Any = {**start, "state": self._words, "buffer": tuple(start["buffer"].tolist())}

    def normal(self, tick: int, n: int) -> Array:
        """Return `n` standard normal numbers of `tick` (>= 0), shape (n,)."""
        return self.fill_normal(tick, np.empty(n))

    def fill_normal(self, tick: int, out: Array) -> Array:
        """Write the same numbers into `out`, shape (n,), and return it."""
        self._seek(tick, _NORMAL)
        return self._generator.standard_normal(out=out)

    def uniform(self, tick: int, n: int) -> Array:
        """Return `n` uniform numbers in [0, 1) of `tick` (>= 0), shape (n,); independent of `normal`."""
        self._seek(tick, _UNIFORM)
        return self._generator.random(n)

    def _seek(self, tick: int, kind: int) -> None:
        # The lowest word counts blocks within a tick. A prepared state is 8x cheaper than a new generator.
        self._words["counter"] = (0, tick, kind, NoiseStream.branch)
        self._bits.state = self._start
