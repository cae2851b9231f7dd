"""How far another computer's clock is from ours, and how sure that is, from questions and answers.

A question leaves at `sent` and its answer comes at `received`, both by our clock; in between, the other side
looked at its clock and saw `seen`. So `seen - received <= offset <= seen - sent`, whatever the two ways took:
Cristian, Probabilistic Clock Synchronization, 1989. The bounds of many exchanges, over which the offset is a
straight line, leave a small polygon of lines: Marzullo and Owicki's intersection, with a drift.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog


@dataclass(frozen=True, kw_only=True)
class ClockOffsetConfig:
    """How much is kept, and believed."""

    window: int = 60
    """Latest exchanges that count."""
    largest_drift: float = 500e-6
    """No computer's clock is worse, as a share of time."""


@dataclass(frozen=True, kw_only=True)
class Offset:
    """The other clock minus ours, at one time."""

    offset_s: float
    """In the middle of what is possible [s]: right if both ways take equally long."""
    bound_s: float
    """It is off by no more [s], however the round trip is split: half of the shortest one, about."""
    drift: float
    """How much faster the other one goes, as a share."""


class ClockOffset:
    """Follows the offset of one other clock."""

    def __init__(self, config: ClockOffsetConfig | None = None) -> None:
        """Know nothing yet."""
        self._config = config = config or ClockOffsetConfig()
        self._exchanges: deque[tuple[int, int, int]] = deque(maxlen=config.window)
        self.steps = 0
        """How often the other clock was set, or its computer started again."""

    def add(self, sent_ns: int, seen_ns: int, received_ns: int) -> None:
        """Take in an exchange; an answer that came before its question is none."""
        if received_ns >= sent_ns:
            self._exchanges.append((sent_ns, seen_ns, received_ns))

    def estimate(self) -> Offset | None:
        """Return the offset at the end of the latest exchange; None if there was none."""
        if not self._exchanges:
            return None
        found = self._solved()
        if found is None:  # no line fits: what was before the latest is of a clock that has been set since
            self.steps += 1
            latest = self._exchanges.pop()
            self._exchanges.clear()
            self._exchanges.append(latest)
            found = self._solved()
        return found

    def _solved(self) -> Offset | None:
        """Return what fits all exchanges, None if nothing does."""
        # Small numbers: nanoseconds since 1970 are no doubles.
        sent0, seen0, _ = self._exchanges[-1]
        rows = [(sent - sent0, seen - seen0, received - sent0) for sent, seen, received in self._exchanges]
        sent, seen, received = np.array(rows, dtype=np.float64).T * 1e-9
        now = received[-1]
        # The other clock shows t + a + b (t - now): no more than `seen` when a question is sent, no less when
        # its answer is there.
        ones, most = np.ones_like(sent), self._config.largest_drift
        left = np.vstack([np.column_stack([ones, sent - now]), np.column_stack([-ones, now - received])])
        right = np.concatenate([seen - sent, received - seen])
        ends = [
            linprog(cost, A_ub=left, b_ub=right, bounds=[(None, None), (-most, most)])
            for cost in ((1.0, 0.0), (-1.0, 0.0))
        ]
        if not all(end.success for end in ends):
            return None
        least, largest = (end.x for end in ends)
        middle = (least + largest) / 2.0
        shift = (seen0 - sent0) * 1e-9
        return Offset(
            offset_s=shift + float(middle[0]),
            bound_s=float(largest[0] - least[0]) / 2.0,
            drift=float(middle[1]),
        )
