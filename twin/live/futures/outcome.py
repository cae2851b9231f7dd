"""What became of one future."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, Self

End = Literal["arrived", "failed", "under way", "lost"]
"""`failed`: the goal, the mission or a check; `under way`: neither arrived nor failed when it ended; `lost`:
its process died or took too long."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One future, as far as it was run."""

    number: int
    """From 1, which has the run's own noise."""
    end: End
    reason: str = ""
    """Why it failed, or was lost."""
    arrival_s: float | None = None
    """From the fork to the goal, or to the end of the mission [s]; None: not reached."""
    end_s: float = 0.0
    """From the fork to where this future ends [s]."""
    clearance_m: float | None = None
    """Least distance from anything else than the floor [m], looked at ten times a second."""
    failed_checks: tuple[str, ...] = ()
    """Checks of the scenario that have failed, whatever is still to come."""
    path: tuple[tuple[float, float, float, float], ...] = ()
    """s after the fork, x [m], y [m], yaw [rad] of the base in the world, ten times a second."""
    digest: str = ""
    """Of the whole run from its start to where this future ends."""
    cpu_s: float = 0.0

    @property
    def succeeded(self) -> bool | None:
        """Whether it arrived in time without a failed check; None: that is not known."""
        return None if self.end == "lost" else self.end == "arrived"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return what `to_dict` gave; JSON has no tuples."""
        path = tuple(map(tuple, values["path"]))
        return cls(**{**values, "failed_checks": tuple(values["failed_checks"]), "path": path})
