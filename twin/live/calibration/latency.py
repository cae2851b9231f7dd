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
SIMULTANEOUS_S = 2e-4
"""A controller that runs so soon after a command does not know of it yet."""
_WINDOW_S = 1.0
"""Errors farther apart than this are taken as independent."""
_DRIFTS = np.logspace(-3.0, 0.0, 10)
"""Share of errors that add up in those of windows; the others are of the encoders at their ends."""


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
    freedom: int
    """Degrees of freedom of what the standard deviations are estimated from."""


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
    # The sandwich of Huber (1967): the soft absolute value's first derivative, and its second.
    weight = 1.0 / np.sqrt(1.0 + (error / scale) ** 2)
    window = ((time[1:] - time[0]) // _WINDOW_S).astype(int)
    scores, information = (weight * slope * error).sum(axis=1), float((weight**3 * slope**2).sum())
    late = np.column_stack(
        [np.interp(time - latency, model.time, side) for side in (model.left, model.right)]
    )
    ordered, read = (
        np.array([np.bincount(window, weights=side) for side in np.diff(each, axis=0).T], dtype=np.float64)
        for each in (late, turned)
    )
    counted, of_counts = _counted(ordered, read)
    spread = float(((speeds - speeds.mean(axis=0)) ** 2).sum())
    return LatencyFit(
        latency=latency,
        stddev=_root_of_blocks(scores, window) / information if information else np.inf,
        error=float(np.sqrt((error**2).mean())),
        explained=1.0 - float((error**2).sum()) / spread if spread else 0.0,
        counted=counted,
        counted_stddev=of_counts,
        freedom=max(1, ordered.shape[1] - 1),
    )


def _counted(ordered: Array, turned: Array) -> tuple[Array, Array]:
    """Return which share of what was ordered each side counted, and its standard deviation, shapes (2,).

    An encoder's error at the end of one window is that at the beginning of the next; what wheels do besides
    adds up. How much there is of each is not known: the mean is by their likelihood (Hoeting and others,
    "Bayesian model averaging", Statistical Science 14, 1999).

    Args:
        ordered: In each window, where delays are next to nothing, shape (2, n) [rad].
        turned: As counted, likewise.
    """
    n = ordered.shape[1]
    ends = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    likelihoods, shares, variances = np.zeros(len(_DRIFTS)), [], []
    for i, drift in enumerate(_DRIFTS):
        weight = np.linalg.inv((1.0 - drift) * ends + drift * np.eye(n))
        information = np.maximum(1e-12, np.einsum("si,ij,sj->s", ordered, weight, ordered))
        share = np.einsum("si,ij,sj->s", ordered, weight, turned) / information
        rest = turned - share[:, None] * ordered
        variance = np.maximum(1e-12, np.einsum("si,ij,sj->s", rest, weight, rest) / max(1, n - 1))
        logs = np.linalg.slogdet(weight)[1] - np.log(information) - (n - 1) * np.log(variance)
        likelihoods[i] = logs.sum() / 2.0
        shares.append(share)
        variances.append(variance / information)
    weights = np.exp(likelihoods - likelihoods.max())
    weights /= weights.sum()
    mean: Array = weights @ np.array(shares)
    return mean, np.sqrt(weights @ (np.array(variances) + (np.array(shares) - mean) ** 2))


def _root_of_blocks(scores: Array, block: NDArray[np.int_]) -> float:
    """Return the standard deviation of a sum whose parts near each other are alike."""
    sums = np.bincount(block, weights=scores)
    return float(np.sqrt((sums**2).sum() * len(sums) / max(1, len(sums) - 1)))
