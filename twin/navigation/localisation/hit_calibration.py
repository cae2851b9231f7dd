"""What a robot learns, while it drives, about how its lidar hits the surfaces of its map."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array

_LEAST_SIGMA = 0.02
"""Narrower hits are not believed: a grid is not finer than that [m]."""
_WIDTH = 1.4
"""Hits are taken as so much wider than they are measured: neighbouring beams share the map's faults."""
_FIRST_GAIN, _GAIN = 0.5, 0.02
_LEAST_HITS = 10
_LEAST_SHARE = 0.5


class HitCalibration:
    """Learns where surfaces lie in their cells, and how far beams miss them.

    A map of a mapping run is occupied where beams ended, so its surfaces lie in the middle of their cells on
    average; one that was drawn has them where the drawing put them, often on the border, half a cell away;
    and a lidar may read long or short. A robot whose lidar looks ahead would be believed ahead or behind by
    as much. What is left over of the residuals once the pose is fitted tells it, since a room that is larger
    all around than its map cannot be explained by a pose. Their spread tells how precise the scans really
    are, and so how far to trust the estimate.
    """

    def __init__(self, resolution: float, sigma_hit: float) -> None:
        """Start from surfaces in the middle of their cells.

        Args:
            resolution: Edge of a cell [m].
            sigma_hit: Largest standard deviation of a hit, and that of the start [m].
        """
        self.depth = 0.5 * resolution
        """How far behind the border of an occupied region its surface lies [m]; negative in front of it."""
        self.sigma = sigma_hit
        """Standard deviation to weigh hits with [m]."""
        self._most_sigma = sigma_hit
        self._least_depth, self._most_depth = -resolution, 2.0 * resolution
        self._variance = (sigma_hit / _WIDTH) ** 2
        self._count = 0

    def learn(self, distances: Array) -> bool:
        """Take the signed distances, shape (b,) [m], of beam ends from surfaces at the estimated pose.

        Return whether they are those of a map that fits.

        A scan of which less than half hits what the map knows teaches nothing but doubt.
        """
        residuals = distances + self.depth
        hits = residuals[np.abs(residuals) < 3.0 * self._most_sigma]
        if len(hits) < _LEAST_HITS:
            return False
        if len(hits) < _LEAST_SHARE * len(distances):
            self._spread((self._most_sigma / _WIDTH) ** 2, 0.1)
            return False
        self._count += 1
        gain = max(_FIRST_GAIN / math.sqrt(self._count), _GAIN)
        self.depth = min(max(self.depth - gain * float(np.mean(hits)), self._least_depth), self._most_depth)
        # Of the middle of the hits: a few that struck something else must not widen all others.
        spread = 1.4826 * _median(np.abs(hits - _median(hits)))
        self._spread(spread**2 + float(np.mean(hits)) ** 2, max(gain / 2.0, 0.05))
        return True

    def _spread(self, variance: float, gain: float) -> None:
        self._variance += gain * (variance - self._variance)
        self.sigma = min(max(_WIDTH * math.sqrt(self._variance), _LEAST_SIGMA), self._most_sigma)


def _median(values: Array) -> float:
    """Return the median of numbers, shape (n,); numpy's, which looks for NaN, takes several times as long."""
    ordered, middle = np.sort(values), len(values) // 2
    return float(ordered[middle] if len(values) % 2 else (ordered[middle - 1] + ordered[middle]) / 2.0)
