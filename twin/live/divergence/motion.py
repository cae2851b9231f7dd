"""How far and how much a robot went, as different things tell it, over the last metres.

A wheel of another radius is wrong by the same share of each metre and each turn, another track by that of
each turn, a wheel that slips by a lot in some of them: so shares come with how sure they are, and with by how
much single stretches were off.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array

_FEWEST = 5
"""Stretches that can tell a ratio."""


@dataclass(frozen=True, kw_only=True)
class Ratio:
    """How much of what was told came true."""

    value: float
    stddev: float
    """Of the value, from how much the stretches scatter."""
    drift: float
    """By how much the later half of the stretches tells more than the earlier one."""
    drift_stddev: float


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """The latest one, beside what the ratio of all lets expect."""

    stamp_ns: int
    told: float
    came: float
    residual: float
    """`came` minus what was expected of it."""


class Ratios:
    """Of stretches of a motion in which one thing tells `told`, and a better one `came` [m] or [rad]."""

    def __init__(self, size: int, least: float, *, bias: float = 0.0) -> None:
        """Remember `size` stretches; a ratio needs `least` of motion told [m] or [rad].

        A thing that tells more motion than there is, by about `bias` in each stretch whatever was told, has
        that estimated, too.
        """
        self._rows: deque[tuple[int, float, float]] = deque(maxlen=size)
        self._least, self._bias = least, bias

    def add(self, stamp_ns: int, told: float, came: float) -> None:
        """Take a stretch that ended at a stamp."""
        self._rows.append((stamp_ns, told, came))

    def clear(self) -> None:
        """Forget all."""
        self._rows.clear()

    @property
    def moved(self) -> float:
        """All that is remembered [m] or [rad]."""
        return sum(abs(told) for _, told, _ in self._rows)

    def ratio(self, floor: float) -> Ratio | None:
        """Return the ratio by least squares; None after too little motion.

        Args:
            floor: Standard deviation that a stretch has at least [m] or [rad].
        """
        if len(self._rows) < _FEWEST or self.moved < self._least:
            return None
        _, told, came = np.array(self._rows).T
        came = came - self._found_bias(told, came, floor)
        value, stddev = _slope(told, came, floor)
        # Stretches tell as much as they are long.
        grown = np.cumsum(told * told)
        middle = int(np.searchsorted(grown, grown[-1] / 2.0))
        early, late = slice(None, middle + 1), slice(middle + 1, None)
        if not np.any(told[late]):
            return Ratio(value=value, stddev=stddev, drift=0.0, drift_stddev=stddev)
        (one, one_sd), (two, two_sd) = (_slope(told[part], came[part], floor) for part in (early, late))
        return Ratio(
            value=value, stddev=stddev, drift=two - one, drift_stddev=float(np.hypot(one_sd, two_sd))
        )

    def _found_bias(self, told: Array, came: Array, floor: float) -> float:
        """Return what is measured without motion, with `_bias` as what is known before."""
        if not self._bias:
            return 0.0
        matrix = np.array([[told @ told, told.sum()], [told.sum(), len(told) + (floor / self._bias) ** 2]])
        return float(np.linalg.solve(matrix + 1e-9 * np.eye(2), [told @ came, came.sum()])[1])

    def odd(self, since_ns: int, least: float) -> list[Stretch]:
        """Return stretches that ended since then, and are off by at least so much [m] or [rad].

        What most others tell is expected: the median of their ratios.
        """
        if len(self._rows) < 4:
            return []
        rows = np.array(self._rows)
        big = np.abs(rows[:, 1]) >= 0.25 * np.abs(rows[:, 1]).max()
        usual = float(np.median(rows[big, 2] / rows[big, 1])) if np.any(rows[:, 1]) else 1.0
        usual = usual if 0.8 < usual < 1.25 else 1.0  # whatever it is then, it is no property of a wheel
        return [
            Stretch(stamp_ns=stamp, told=told, came=came, residual=came - usual * told)
            for stamp, told, came in self._rows
            if stamp >= since_ns and abs(came - usual * told) >= least
        ]


def _slope(told: Array, came: Array, floor: float) -> tuple[float, float]:
    """Return a line's slope through the origin, and its standard deviation."""
    squares = float(told @ told)
    if squares == 0.0:
        return 1.0, 1e6
    value = float(told @ came) / squares
    rest = came - value * told
    spread = float(np.sqrt(rest @ rest / max(1, len(told) - 1)))
    return value, max(spread, floor) / squares**0.5
