"""Wheels and mounting of the lidar by comparing dead reckoning with where the lidar was.

The idea is that of Censi, Franchi, Marchionni, Oriolo, "Simultaneous calibration of odometry and sensor
parameters for mobile robots", IEEE T-RO 29 (2013). Here an error of one scan's pose is known to be in two
increments, and how large the errors are is estimated with the rest, by their likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky_banded, solve_banded
from scipy.optimize import minimize

from twin.geometry import Array
from twin.live.calibration.dead_reckoning import MOUNT, Increments, compose, inverse

_VAGUE = np.array([0.3, 0.3, 0.3, 1.0, 0.3, 0.5, 0.5, 1.0, 0.3])
"""What is known of `PARAMETERS` before: next to nothing; it only keeps what is not observable finite."""
_STEP = 1e-5
_STEPS, _ROUNDS = 2, 6
_OUTLIER = 6.0
"""Of the standard deviation: increments in which something else happened."""
_MOST_LEFT_OUT = 0.05
"""Where more is beyond that, the errors are just not normal."""
_FEWEST = 20
_BLOCK_S = 3.0
"""Errors farther apart than this are taken as independent."""
_BOUNDS = float(np.log(1e-12)), float(np.log(10.0))
"""Of the noise; less is nothing."""
_LIKELY = (1.0, 1e-9, 1e-7, 1e-7, 1e-6)
"""Where the search for the noise begins: factor of the scans' covariance; error of wheels at an instant [m²];
slip per metre, along, aside [m²/m] and about [rad²/m]."""
_DRAWS = 1500
_STRIDES = (0.1, 3.0, 3.0, 3.0, 3.0)
"""Of the draws, among logarithms of the noise: the scans' is known well, the rest is not."""


@dataclass(frozen=True, kw_only=True)
class DriveFit:
    """The result."""

    values: Array
    """Of `PARAMETERS`, shape (9,)."""
    covariance: Array
    """Shape (9, 9)."""
    left_out: int
    """Increments that do not fit."""


def fit_drive(
    increments: Increments, poses: Array, covariances: Array, start: Array, track: float
) -> DriveFit:
    """Return what fits best.

    Args:
        increments: Of the wheels, between the instants of the scans.
        poses: Of the lidar in the world, shape (k + 1, 3).
        covariances: Of these in the lidar's frame, shape (k + 1, 3, 3).
        start: What is believed, of `PARAMETERS`, shape (9,).
        track: [m]

    Raises:
        ValueError: There are too few.
    """
    seen = compose(inverse(poses[:-1]), poses[1:])
    used = np.ones(len(seen), dtype=bool)
    if len(seen) < _FEWEST:
        raise ValueError(f"{len(seen)} increments; at least {_FEWEST} are needed")
    values, logs = start.copy(), np.log(_LIKELY)

    def errors(values: Array) -> Array:
        wrong = compose(inverse(seen), increments.lidar(values))
        wrong[:, 2] = np.remainder(wrong[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        return wrong

    def near(values: Array) -> _Near:
        slopes = [
            (errors(values + h) - errors(values - h)) / (2.0 * _STEP) for h in _STEP * np.eye(len(start))
        ]
        rows = np.stack([*slopes, errors(values)], axis=-1)
        return _Near(whitening, rows, used, (values - start) / _VAGUE**2)

    whitening = _Whitening(seen, covariances, increments, start, track)
    for again in range(_ROUNDS):
        for _ in range(_STEPS):
            values = values + near(values).given(logs).step
        here = near(values)
        bad = np.abs(here.given(logs).white[..., -1]).max(axis=1) > _OUTLIER
        is_some = again > 0 and 0 < np.count_nonzero(bad) < _MOST_LEFT_OUT * np.count_nonzero(used)
        if again >= _STEPS and not is_some:
            break
        if is_some:
            used[np.flatnonzero(used)[bad]] = False
        logs = minimize(
            lambda logs, here=here: -here.likelihood(logs),
            logs,
            method="Powell",
            bounds=[_BOUNDS] * len(logs),
            options={"ftol": 1e-6, "xtol": 1e-2},
        ).x
    likeliest = here.given(logs)
    scores = np.einsum("kip,ki->kp", likeliest.white[..., :-1], likeliest.white[..., -1])
    step, covariance = _averaged(here, logs)
    inflation = _inflation(scores @ likeliest.covariance, np.cumsum(increments.seconds)[used], covariance)
    return DriveFit(
        values=values + step,
        covariance=covariance * np.outer(inflation, inflation),
        left_out=int(np.count_nonzero(~used)),
    )


class _Given(NamedTuple):
    """What follows from one size of the noise."""

    step: Array
    """To the values that fit best, shape (9,)."""
    covariance: Array
    """Of these, shape (9, 9)."""
    likelihood: float
    """Of that noise, whatever the values are: its logarithm."""
    white: Array
    """Slopes and errors, made independent and of unit variance, shape (k, 3, 10)."""


class _Near:
    """The errors, near some values."""

    def __init__(self, whitening: _Whitening, rows: Array, used: NDArray[np.bool_], pull: Array) -> None:
        """Take slopes by each value and the errors, shape (k, 3, 10), and the pull of what is believed."""
        self._whitening, self._rows, self._used, self._pull = whitening, rows, used, pull

    def given(self, logs: Array) -> _Given:
        """Return what follows; raises LinAlgError where no errors can be like that."""
        factor = self._whitening.factor(self._used, np.exp(logs))
        white = self._whitening.whiten(self._rows, self._used, factor)
        flat = white.reshape(-1, white.shape[-1])
        slopes, error = flat[:, :-1], flat[:, -1]
        information = slopes.T @ slopes + np.diag(_VAGUE**-2.0)
        covariance, pull = np.linalg.inv(information), slopes.T @ error + self._pull
        step = -covariance @ pull
        deviance = error @ error + pull @ step + 2.0 * np.log(factor[0]).sum()
        likelihood = -(deviance + np.linalg.slogdet(information)[1]) / 2.0
        return _Given(step, np.asarray(covariance, np.float64), float(likelihood), white)

    def likelihood(self, logs: Array) -> float:
        """Return that of `given`; minus infinity where no errors can be like that."""
        try:
            return self.given(logs).likelihood
        except LinAlgError:
            return -np.inf


def _averaged(near: _Near, logs: Array) -> tuple[Array, Array]:
    """Return step and covariance, averaged over the sizes of the noise, each as likely as it is.

    The likeliest alone would make intervals too narrow: of some noise there is too little to be seen, but
    enough to matter. Of its order of magnitude nothing is known before. Draws are those of Metropolis and
    others, Journal of Chemical Physics 21 (1953), one size at a time.
    """
    rng = np.random.Generator(np.random.Philox(0))
    step, covariance, likelihood, _ = near.given(logs)
    drawn = []
    for draw in range(_DRAWS):
        tried = logs.copy()
        tried[draw % len(logs)] += _STRIDES[draw % len(logs)] * rng.normal()
        chance = np.log(rng.uniform())
        is_possible = _BOUNDS[0] <= tried.min() and tried.max() <= _BOUNDS[1]
        if is_possible and chance < near.likelihood(tried) - likelihood:
            logs = tried
            step, covariance, likelihood, _ = near.given(logs)
        drawn.append((step, covariance))
    steps, covariances = map(np.array, zip(*drawn, strict=True))
    return steps.mean(axis=0), covariances.mean(axis=0) + np.cov(steps.T, bias=True)


class _Whitening:
    """The covariance of errors of increments: of errors at their instants, and of what adds up between."""

    def __init__(
        self, seen: Array, covariances: Array, increments: Increments, believed: Array, track: float
    ) -> None:
        mount = believed[MOUNT]
        # Errors of the base, seen from the lidar.
        moved = np.broadcast_to(_adjoint(inverse(mount)), (len(seen), 3, 3))
        back = _adjoint(inverse(seen))
        self._scan, self._back = covariances, back
        wheel = np.diag([0.5, 0.0, 2.0 / track**2])
        self._wheel = moved[0] @ wheel @ moved[0].T
        self._slips = [
            np.einsum("k,ij->kij", increments.distance, moved[0] @ np.diag(axis) @ moved[0].T)
            for axis in np.eye(3)
        ]

    def factor(self, used: NDArray[np.bool_], noise: Array) -> Array:
        """Return the lower Cholesky factor as a band, shape (6, 3 k)."""
        at = noise[0] * self._scan + noise[1] * self._wheel
        back = self._back
        own = at[1:] + back @ at[:-1] @ back.transpose(0, 2, 1)
        own = own + sum(q * slip for q, slip in zip(noise[2:], self._slips, strict=True))
        below = -back[1:] @ at[1:-1]  # of an increment with the one before
        kept = np.flatnonzero(used)
        own, below = own[kept], below[kept[1:] - 1] * (np.diff(kept) == 1)[:, None, None]
        n = len(kept)
        band = np.zeros((6, 3 * n))
        for i in range(3):
            for j in range(i + 1):
                band[i - j, j::3] = own[:, i, j]
            for j in range(3):
                band[3 + i - j, j : 3 * (n - 1) : 3] = below[:, i, j]
        return np.asarray(cholesky_banded(band, lower=True, check_finite=False))

    def whiten(self, errors: Array, used: NDArray[np.bool_], factor: Array) -> Array:
        """Return independent errors of unit variance from such of shape (k, 3, n)."""
        flat = errors[used].reshape(-1, errors.shape[-1])
        white = solve_banded((5, 0), factor, flat, check_finite=False)
        return np.asarray(white).reshape(-1, *errors.shape[1:])


def _adjoint(pose: Array) -> Array:
    """Return how small motions in one frame look in another, shape (..., 3, 3)."""
    c, s, one, zero = (
        np.cos(pose[..., 2]),
        np.sin(pose[..., 2]),
        np.ones_like(pose[..., 2]),
        np.zeros_like(pose[..., 2]),
    )
    rows = [[c, -s, pose[..., 1]], [s, c, -pose[..., 0]], [zero, zero, one]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _inflation(moves: Array, times: Array, covariance: Array) -> Array:
    """Return by how much standard deviations must grow as errors near each other are alike, shape (p,).

    It is 1 or more, from sums over blocks of time of how far each step moves the values: the sandwich of
    Liang and Zeger, Biometrika 73 (1986).
    """
    block = ((times - times[0]) // _BLOCK_S).astype(int)
    sums = np.stack([np.bincount(block, weights=column) for column in moves.T], axis=-1)
    count = len(sums)
    robust = (sums**2).sum(axis=0) * count / max(1, count - 1)
    return np.maximum(1.0, np.sqrt(robust / np.diag(covariance)))
