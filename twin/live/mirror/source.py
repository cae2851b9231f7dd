"""Where a mirror hears of the physical robots."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig
    from twin.live.mirror.followed_clock import FollowedClock
    from twin.runtime.open_run import OpenRun
    from twin.runtime.pacing import Pace


@dataclass(frozen=True, kw_only=True)
class ClockReading:
    """What is known of a robot's clock."""

    offset_s: float | None = None
    """It is ahead of the one of this computer, or of the recorder, by so much [s]; None: nothing tells."""
    bound_s: float | None = None
    """The offset is off by no more [s]; None: nothing bounds it."""
    text: str = "the robot's clock is not known"
    """Why not."""


@dataclass(frozen=True, kw_only=True)
class ClockChange:
    """The mirror's time, or that of what a robot says, does not go on as before."""

    what: Literal["clock", "met", "pace"]
    """Whether a robot's clock was set, is known from now on, or this computer was too slow."""
    set_by_ns: int
    """How much later it is all at once [ns]."""
    robot: str | None = None
    """Whose clock; None: that of all."""

    @property
    def text(self) -> str:
        """For people."""
        if self.what == "clock":
            return f"the robot's clock was set by {self.set_by_ns * 1e-9:+.3f} s"
        return f"this computer was too slow: {self.set_by_ns * 1e-9:.3f} s are lost"


class Source(ABC):
    """The graph of live robots, or a bag of them."""

    network: SessionConfig | None = None
    """What the mirror joins; None: nothing."""
    pace: Pace | None = None
    """How fast it goes; None: as fast as possible."""
    is_live = False
    """Whether commands reach the robots."""

    @property
    @abstractmethod
    def start_ns(self) -> int:
        """A first guess of what the robots' clock shows at the start [ns since 1970]."""

    @abstractmethod
    def reading(self, robot: str) -> ClockReading:
        """Return what is known of a robot's clock now."""

    @property
    def over(self) -> bool:
        """Whether nothing comes any more."""
        return False

    @abstractmethod
    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        """Take the mirror's run and its clock, before the first tick."""

    @abstractmethod
    def after_tick(self) -> Sequence[ClockChange]:
        """Keep the clock, bring what has come; return what has happened to clocks."""

    @abstractmethod
    def close(self) -> None:
        """Leave. Harmless when repeated."""
