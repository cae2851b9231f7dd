"""Choice between several sources of velocity commands, after ROS's `twist_mux`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class MuxInput:
    """One source of commands."""

    name: str
    topic: str
    priority: int
    """0 … 255; the highest live source wins."""
    timeout: float = 0.5
    """A source without a command for this long is not live [s]."""
    guarded: bool = True
    """Whether a collision monitor, where there is one, sees its commands."""


class TwistMux:
    """Passes the command of the live source with the highest priority."""

    def __init__(self, inputs: Sequence[MuxInput]) -> None:
        self._inputs = sorted(inputs, key=lambda source: -source.priority)
        self._stamps = {source.name: -math.inf for source in inputs}

    def accept(self, name: str, now: float) -> bool:
        """Note a command of source `name` at `now` [s]; return whether it is the one to pass on."""
        self._stamps[name] = now
        return self.active(now) == name

    def active(self, now: float) -> str | None:
        """Return the name of the source in charge at `now` [s]."""
        live = (each.name for each in self._inputs if now - self._stamps[each.name] <= each.timeout)
        return next(live, None)
