"""How long it takes from a command to the motion that it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from twin.geometry import Array
from twin.live.calibration.dead_reckoning import Wheels

LONGEST_S, _EARLIEST_S = 1.0, 0.1
_SEARCH_S = 0.01
_FINEST_S = 1e-4
"""Stamps and ticks of drivers are told apart no finer."""
SIMULTANEOUS_S = 2e-4
"""A controller that runs so soon after a command does not know of it yet."""
_WINDOW_S = 1.0
_BLOCK_S = 3.0


@dataclass(frozen=True, kw_only=True)
class LatencyFit:
    """The result."""

    latency: float
    """[s]"""
    stddev: float
    """[s]"""
    error: float
    """Root mean square of what remains of the wheels' speeds [rad/s]."""
    explained: float
    """Share of the variance of the wheels' speeds that the model and the latency explain."""
    counted: Array
    """How far the encoders of each side say that the wheels turned, of what the model's did, shape (2,)."""
    counted_stddev: Array
    """Shape (2,)."""


def fit_latency(model: Wheels, wheels: Wheels) -> LatencyFit:
    """Return by how much wheels turn later than those of a model.

    Args:
        model: Of them.
        wheels: As they turned; what is not `LONGEST_S` after the model's beginning is not looked at.
    """
    inside = (wheels.time > model.time[0] + LONGEST_S) & (wheels.time <= model.time[-1])
    time = wheels.time[inside]
    turned = np.column_stack([wheels.left, wheels.right])[inside]
    gaps = np.diff(time)
    speeds = np.diff(turned, axis=0) / gaps[:, None]

    def errors(latency: float) -> Array:
        late = np.column_stack(
            [np.interp(time - latency, model.time, side) for side in (model.left, model.right)]
        )
        meant = np.diff(late, axis=0) / gaps[:, None]
        squares = np.maximum((meant**2).sum(axis=0), 1e-12)
        # Encoders need not count alike.
        return np.asarray(speeds - meant * (meant * speeds).sum(axis=0) / squares)

    tried = np.arange(-_EARLIEST_S, LONGEST_S, _SEARCH_S)
    best = tried[np.argmin([np.abs(errors(latency)).sum() for latency in tried])]
    scale = max(1e-3, 1.4826 * float(np.median(np.abs(errors(best)))))
    # Soft absolute values: in some moments a wheel does what no controller orders.
    latency = float(
        minimize_scalar(
            lambda late: np.sqrt(1.0 + (errors(late) / scale) ** 2).sum(),
            bounds=(best - _SEARCH_S, best + _SEARCH_S),
            method="bounded",
            options={"xatol": 1e-6},
        ).x
    )
    h = 2e-3
    slope = (errors(latency + h) - errors(latency - h)) / (2.0 * h)
    error = errors(latency)
    weight = 1.0 / np.sqrt(1.0 + (error / scale) ** 2)
    block = ((time[1:] - time[0]) // _BLOCK_S).astype(int)
    scores, information = (weight * slope * error).sum(axis=1), float((weight * slope**2).sum())
    late = np.column_stack(
        [np.interp(time - latency, model.time, side) for side in (model.left, model.right)]
    )
    counted, of_counts = _counted(np.diff(turned, axis=0), np.diff(late, axis=0), time[1:])
    spread = float(((speeds - speeds.mean(axis=0)) ** 2).sum())
    return LatencyFit(
        latency=latency,
        stddev=np.hypot(_FINEST_S, _root_of_blocks(scores, block) / information) if information else np.inf,
        error=float(np.sqrt((error**2).mean())),
        explained=1.0 - float((error**2).sum()) / spread if spread else 0.0,
        counted=counted,
        counted_stddev=of_counts,
    )


def _counted(turned: Array, ordered: Array, time: Array) -> tuple[Array, Array]:
    """Return which share of what was ordered was counted, by sums over windows: delays are nothing there."""
    window = ((time - time[0]) // _WINDOW_S).astype(int)
    sums = [np.stack([np.bincount(window, weights=side) for side in each.T]) for each in (ordered, turned)]
    x, y = sums
    squares = np.maximum((x**2).sum(axis=1), 1e-12)
    share = (x * y).sum(axis=1) / squares
    rest = y - share[:, None] * x
    return share, np.sqrt((rest**2).sum(axis=1) / max(1, x.shape[1] - 1) / squares)


def _root_of_blocks(scores: Array, block: NDArray[np.int_]) -> float:
    """Return the standard deviation of a sum whose parts near each other are alike."""
    sums = np.bincount(block, weights=scores)
    return float(np.sqrt((sums**2).sum() * len(sums) / max(1, len(sums) - 1)))
