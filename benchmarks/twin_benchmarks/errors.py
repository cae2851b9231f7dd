"""What a user of the benchmarks can act on."""

from __future__ import annotations

from twin.errors import TwinError


class BenchmarkError(TwinError):
    """A benchmark's file is wrong."""
