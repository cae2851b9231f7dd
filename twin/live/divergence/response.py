"""How the physical robot's wheels answer commands, beside those of the virtual one that obeys the same."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array

_WINDOW_NS = 8_000_000_000
_PERIOD_NS = 20_000_000
_LONGEST_NS = 1_000_000_000
_EARLIEST_NS = 200_000_000
_ARM = 0.3
"""So far from the middle of the robot a turn counts as a way [m]."""
_CHANGE = 0.04
"""Speeds that scatter less tell nothing about delays [m/s]."""
_LEAST = 0.4
"""So far the virtual robot must have gone [m]."""
_FIT = 0.5
"""Share of the change of speed that a delay must explain, or there is none."""


@dataclass(frozen=True, kw_only=True)
class Response:
    """Over the last seconds."""

    ratio: float | None
    """How far the physical robot's wheels went, as a share of the virtual one's; None: it stood."""
    latency_s: float | None
    """How much later they did so [s]; None: nothing tells."""


class Responses:
    """Compares speeds by odometry."""

    def __init__(self) -> None:
        """Begin without speeds."""
        self._physical: deque[tuple[int, float, float]] = deque()
        self._virtual: deque[tuple[int, float, float]] = deque()

    def physical(self, stamp_ns: int, speed: float, turn: float) -> None:
        """Take what odometry tells of the physical robot [m/s, rad/s]."""
        _take(self._physical, stamp_ns, speed, turn)

    def virtual(self, stamp_ns: int, speed: float, turn: float) -> None:
        """The same of the virtual robot."""
        _take(self._virtual, stamp_ns, speed, turn)

    def clear(self) -> None:
        """Forget all."""
        self._physical.clear()
        self._virtual.clear()

    def report(self) -> Response:
        """Return how the last seconds compare."""
        nothing = Response(ratio=None, latency_s=None)
        if len(self._physical) < 50 or len(self._virtual) < 50:
            return nothing
        last = min(self._physical[-1][0], self._virtual[-1][0])
        first = max(self._physical[0][0], self._virtual[0][0])
        if last - first < _WINDOW_NS // 2:
            return nothing
        times = np.arange(first, last, _PERIOD_NS, dtype=np.float64)
        physical, virtual = (_sampled(rows, times, first) for rows in (self._physical, self._virtual))
        way = np.abs(virtual).sum() * _PERIOD_NS * 1e-9
        ratio = float(np.abs(physical).sum() / np.abs(virtual).sum()) if way >= _LEAST else None
        return Response(ratio=ratio, latency_s=_latency(physical, virtual))


def _take(rows: deque[tuple[int, float, float]], stamp_ns: int, speed: float, turn: float) -> None:
    if rows and stamp_ns <= rows[-1][0]:
        return
    rows.append((stamp_ns, speed, _ARM * turn))
    while stamp_ns - rows[0][0] > _WINDOW_NS:
        rows.popleft()


def _sampled(rows: deque[tuple[int, float, float]], times: Array, first: int) -> Array:
    stamps = np.array([row[0] - first for row in rows], dtype=np.float64)
    values = np.array([row[1:] for row in rows])
    return np.array([np.interp(times - first, stamps, values[:, k]) for k in range(2)])


def _latency(physical: Array, virtual: Array) -> float | None:
    """Return by how much one series is later than the other; both of shape (2, n)."""
    early, late = _EARLIEST_NS // _PERIOD_NS, _LONGEST_NS // _PERIOD_NS
    inner = physical[:, late : physical.shape[1] - early]
    if inner.shape[1] < 2 * late:
        return None
    spread = inner - inner.mean(axis=1, keepdims=True)
    scatter = float(np.sqrt(np.mean(spread**2)))
    if scatter < _CHANGE:
        return None
    lags = np.arange(-early, late + 1)
    costs = np.array(
        [np.mean((inner - virtual[:, late - lag : physical.shape[1] - early - lag]) ** 2) for lag in lags]
    )
    best = int(np.argmin(costs))
    if costs[best] > (1.0 - _FIT) * scatter**2 or not 0 < best < len(lags) - 1:
        return None
    left, middle, right = costs[best - 1 : best + 2]
    bend = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / bend if bend > 0.0 else 0.0
    return float((lags[best] + shift) * _PERIOD_NS * 1e-9)
