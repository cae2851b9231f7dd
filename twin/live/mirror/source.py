"""Where a mirror hears of the physical robots."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig
    from twin.live.mirror.followed_clock import FollowedClock
    from twin.runtime.open_run import OpenRun
    from twin.runtime.pacing import Pace


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

    @property
    def clock_bound_s(self) -> float | None:
        """How well the robots' clock is known [s]; None: it is not."""
        return None

    @property
    def clock_offset_s(self) -> float | None:
        """The robots' clock minus the one of this computer, or of the recorder [s]; None: it is not known."""
        return None

    @property
    def over(self) -> bool:
        """Whether nothing comes any more."""
        return False

    @abstractmethod
    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        """Take the mirror's run and its clock, before the first tick."""

    @abstractmethod
    def after_tick(self) -> tuple[str, str] | None:
        """Keep the clock, bring what has come; return name and text of an event of the clock."""

    @abstractmethod
    def close(self) -> None:
        """Leave. Harmless when repeated."""
