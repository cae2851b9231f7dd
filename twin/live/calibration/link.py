"""The way of messages from a robot to who recorded them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Array

_WINDOWS = 20
_JUMP_S = 0.2
_DRIFT = 2e-3
"""No clock that works is worse."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """How late messages came; what of it is the other clock, and what the link, one side cannot tell."""

    least: float
    """Least difference of arrival and stamp at the start: offset of the clocks plus least delay [s]."""
    drift: float
    """How much it grows, per second."""
    usual: float
    """By how much half of the messages are later than the least [s]."""
    jitter: float
    """By how much 95 % of the messages are later than the least at most [s]."""
    jump: tuple[float, float] | None
    """When the robot's clock jumped [s], and by how much [s]; None: it did not."""

    def heard_at(self, stamp: Array) -> Array:
        """Return when what is stamped so would have been heard at the earliest [s]."""
        return stamp + self.least + self.drift * (stamp + self.least)


def link_of(heard: Array, late: Array) -> Link:
    """Return the link of messages heard at times, by so much after their stamps, shapes (n,) [s]."""
    order = np.argsort(heard, kind="stable")
    heard, late = heard[order], late[order]
    before, after = np.minimum.accumulate(late)[:-1], np.minimum.accumulate(late[::-1])[::-1][1:]
    change = after - before
    limit = _JUMP_S + _DRIFT * float(heard[-1] - heard[0])
    beyond, jump = np.flatnonzero(np.abs(change) > limit), None
    if len(beyond):
        # Of a clock that goes back the later messages are all later, of one that goes ahead the earlier ones.
        at = beyond[0] if change[beyond[0]] > 0.0 else beyond[-1]
        jump = float(heard[at + 1]), -float(change[at])
    chunks = [part for part in np.array_split(np.arange(len(heard)), _WINDOWS) if len(part)]
    lowest = np.array([part[np.argmin(late[part])] for part in chunks])
    drift, least = (0.0, float(late.min())) if len(lowest) < 3 else np.polyfit(heard[lowest], late[lowest], 1)
    rest = late - (least + drift * heard)
    least += float(rest.min())
    return Link(
        least=float(least),
        drift=float(drift),
        usual=float(np.median(rest - rest.min())),
        jitter=float(np.percentile(rest - rest.min(), 95)),
        jump=jump,
    )
