"""Wheels and mounting of the lidar by comparing dead reckoning with where the lidar was.

The idea is that of Censi, Franchi, Marchionni, Oriolo, "Simultaneous calibration of odometry and sensor
parameters for mobile robots", IEEE T-RO 29 (2013). Here an error of one scan's pose is known to be in two
increments, and how large the errors are is estimated with the rest, by maximum likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky_banded, solve_banded
from scipy.optimize import minimize

from twin.geometry import Array
from twin.live.calibration.dead_reckoning import MOUNT, PARAMETERS, Increments, compose, inverse

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
_LEAST_VARIANCE, _MOST_VARIANCE = 1e-14, 10.0
_LIKELY = (1.0, 1e-9, 1e-7, 1e-7, 1e-6)
"""Where the search for the noise begins: factor of the scans' covariance; error of wheels at an instant [m²];
slip per metre, along, aside [m²/m] and about [rad²/m]."""


@dataclass(frozen=True, kw_only=True)
class DriveFit:
    """The result."""

    values: Array
    """Of `PARAMETERS`, shape (9,)."""
    covariance: Array
    """Shape (8, 8)."""
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

    whitening = _Whitening(seen, covariances, increments, start, track)
    for again in range(_ROUNDS):
        factor = whitening.factor(used, np.exp(logs))
        for _ in range(_STEPS):
            error = whitening.whiten(errors(values), used, factor)
            jacobian = np.stack(
                [
                    whitening.whiten((errors(values + h) - errors(values - h)) / (2.0 * _STEP), used, factor)
                    for h in _STEP * np.eye(len(PARAMETERS))
                ],
                axis=-1,
            )
            information = np.einsum("kip,kiq->pq", jacobian, jacobian) + np.diag(_VAGUE**-2.0)
            pull = np.einsum("kip,ki->p", jacobian, error) + (values - start) / _VAGUE**2
            values = values - np.linalg.solve(information, pull)
        bad = np.abs(whitening.whiten(errors(values), used, factor)).max(axis=1) > _OUTLIER
        is_some = again > 0 and 0 < np.count_nonzero(bad) < _MOST_LEFT_OUT * np.count_nonzero(used)
        if again >= _STEPS and not is_some:
            break
        if is_some:
            used[np.flatnonzero(used)[bad]] = False
        error = errors(values)
        logs = minimize(
            lambda logs, error=error: whitening.deviance(error, used, np.exp(logs)),
            logs,
            method="Powell",
            bounds=[(np.log(_LEAST_VARIANCE), np.log(_MOST_VARIANCE))] * 5,
            options={"ftol": 1e-6, "xtol": 1e-2},
        ).x
    covariance = np.linalg.inv(information)
    error = whitening.whiten(errors(values), used, factor)
    scores = np.einsum("kip,ki->kp", jacobian, error)
    inflation = _inflation(scores, np.cumsum(increments.seconds)[used], covariance)
    return DriveFit(
        values=values,
        covariance=covariance * np.outer(inflation, inflation),
        left_out=int(np.count_nonzero(~used)),
    )


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

    def factor(self, used: Array, noise: Array) -> Array:
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

    def whiten(self, errors: Array, used: Array, factor: Array) -> Array:
        """Return independent errors of unit variance, shape (k, 3)."""
        flat = errors[used].reshape(-1)
        return np.asarray(solve_banded((5, 0), factor, flat, check_finite=False)).reshape(-1, 3)

    def deviance(self, errors: Array, used: Array, noise: Array) -> float:
        """Return minus twice the logarithm of the likelihood."""
        try:
            factor = self.factor(used, noise)
        except LinAlgError:
            return np.inf
        white = self.whiten(errors, used, factor)
        return float((white**2).sum() + 2.0 * np.log(factor[0]).sum())


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


def _inflation(scores: Array, times: Array, covariance: Array) -> Array:
    """Return by how much standard deviations must grow as errors near each other are alike, shape (p,).

    It is 1 or more, from sums over blocks of time: the sandwich of Liang and Zeger, Biometrika 73 (1986).
    """
    block = ((times - times[0]) // _BLOCK_S).astype(int)
    sums = np.stack([np.bincount(block, weights=column) for column in scores.T], axis=-1)
    count = len(sums)
    robust = ((sums @ covariance) ** 2).sum(axis=0) * count / max(1, count - 1)
    return np.maximum(1.0, np.sqrt(robust / np.diag(covariance)))
