"""The clock of a run: simulated time as an integer of nanoseconds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Clock:
    """Simulated time; only the runtime writes it, everybody reads it."""

    now_ns: int = 0
    """[ns] since the start of the run."""
