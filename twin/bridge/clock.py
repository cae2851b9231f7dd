"""The clock of a run: simulated time as an integer of nanoseconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True, order=True)
class Instant:
    """A point in time, in the shape of rclpy's Time."""

    nanoseconds: int

    def to_msg(self) -> Any:
        """Return it as builtin_interfaces/msg/Time."""
        from twin.bridge.msgs import stamp

        return stamp(self.nanoseconds)


@dataclass(slots=True)
class Clock:
    """Simulated time; only the runtime writes it, everybody reads it."""

    now_ns: int = 0
    """[ns] since the start of the run."""
    is_simulated: ClassVar[bool] = True
    """Whether others are told of it on `/clock`."""

    @property
    def steady_ns(self) -> int:
        """For durations: as `now_ns`, but never set [ns]."""
        return self.now_ns

    def now(self) -> Instant:
        """Return the present time; `clock.now().to_msg()` is a stamp."""
        return Instant(self.now_ns)
