"""How much a scan tells about the pose: beams on one surface share the map's fault there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit

_SAME_DIRECTION = math.cos(math.radians(20.0))
_FORGET = 0.02
"""Gain of what is learnt about the map's faults: they are the same in all of it."""
_FOLLOW = 0.3
"""Gain of the exponent: what surfaces are in sight changes within metres."""
_LEAST, _MOST = 0.02, 4.0
_FIRST_COUNT = 30.0
"""The guess of the map's faults counts like so many beams, about those of one scan."""
_LONE_WALL = 1e8
"""Condition of a fit beyond which surfaces do not tell a pose."""
_POSE = 3


@dataclass(frozen=True, kw_only=True)
class ScanError:
    """How wrong the pose is that fits a scan best."""

    covariance: Array
    """Of x, y, yaw, shape (3, 3)."""
    fault_share: float
    """How much of it, 0 ... 1, is due to the map, and will be the same in the next scan."""

    def joined(self, prior: Array) -> Array:
        """Return the covariance, shape (3, 3), of the pose after the scan was taken in.

        Along the axes that prior and scan have in common the variances join as independent ones do; but what
        the map's faults allow is not undercut however often a robot looks at them.

        Args:
            prior: Covariance before, shape (3, 3), positive definite.
        """
        root = np.linalg.cholesky(self.covariance)
        whitened = np.linalg.solve(root, np.linalg.solve(root, prior).T)
        variances, axes = np.linalg.eigh(0.5 * (whitened + whitened.T))
        variances = np.maximum(variances, 1e-9)
        joint = np.maximum(variances / (1.0 + variances), np.minimum(variances, self.fault_share))
        basis = root @ axes
        return np.asarray(basis * joint @ basis.T)


class ScanEvidence:
    """Learns how far whole surfaces are off their place on the map, and so what a scan is worth.

    A beam misses the map by its own noise and by the fault that the surface it hits has on the map, which
    all beams on that surface share: a hundred beams on a wall that was drawn 1 cm off are all 1 cm wrong. The
    two variances come from the residuals at the fitted pose, by the method of moments of a meta-regression
    with random effects: surfaces are its studies, the three unknowns of the pose its covariates. From them
    follows how wide the error of the fitted pose really is, and the exponent that gives the filter's
    likelihood that width.
    Sources: Thompson and Sharp, Explaining heterogeneity in meta-analysis, 1999 (the moments); Pauli, Racugno
    and Ventura, Bayesian composite marginal likelihoods, 2011 (the exponent).
    """

    def __init__(self, exponent: float, resolution: float) -> None:
        """Start from a guess.

        Args:
            exponent: The first one.
            resolution: Of the map [m]: at first borders are taken to lie anywhere in their cells, and
                surfaces that are in line to this are one.
        """
        self.exponent = exponent
        """Of a beam's likelihood."""
        self._resolution = resolution
        self._noise = self._noise_count = 0.0
        self._fault, self._fault_count = _FIRST_COUNT * resolution**2 / 12.0, _FIRST_COUNT

    @property
    def noise(self) -> float:
        """Standard deviation of a beam about its surface [m]."""
        return math.sqrt(self._noise / self._noise_count) if self._noise_count else 0.0

    @property
    def fault(self) -> float:
        """Standard deviation of a surface about its place on the map [m]."""
        return math.sqrt(max(self._fault / self._fault_count, 0.0))

    def learn(self, residuals: Array, normals: Array, points: Array, sigma: float) -> ScanError | None:
        """Take how a scan fits at the estimated pose; return how wrong that may be, None if it has no pose.

        Args:
            residuals: How far beams end in front of their surface, shape (b,) [m].
            normals: Of the surfaces in the map frame, shape (b, 2), of length 1.
            points: Where the beams end, from the robot, along the axes of the map, shape (b, 2) [m].
            sigma: Standard deviation that the filter weighs hits with [m].
        """
        surface = same_surface(points, normals, self._resolution)
        counts = np.bincount(surface).astype(np.float64)
        freedom = len(residuals) - len(counts)
        rows = np.column_stack([normals, points[:, 0] * normals[:, 1] - points[:, 1] * normals[:, 0]])
        information = rows.T @ rows
        if freedom < _POSE or np.linalg.cond(information) > _LONE_WALL:
            return None
        means = np.bincount(surface, residuals) / counts
        sums: Array = np.stack([np.bincount(surface, column) for column in rows.T], axis=1).astype(np.float64)
        within = residuals - means[surface]
        self._noise += _FORGET * (float(within @ within) - self._noise)
        self._noise_count += _FORGET * (freedom - self._noise_count)
        if len(counts) > _POSE:  # the pose explains fewer surfaces whatever their faults are
            self._learn_fault(means, counts, sums / counts[:, None])
        return self._error(information, sums, sigma)

    def _learn_fault(self, means: Array, counts: Array, rows: Array) -> None:
        weighted = counts[:, None] * rows
        left_of = np.eye(len(means)) - rows @ np.linalg.pinv(rows.T @ weighted) @ weighted.T
        shares = counts @ left_of**2
        excess = float(counts @ (left_of @ means) ** 2) - self.noise**2 * float(shares @ (1.0 / counts))
        self._fault += _FORGET * (excess - self._fault)
        self._fault_count += _FORGET * (float(shares.sum()) - self._fault_count)

    def _error(self, information: Array, sums: Array, sigma: float) -> ScanError:
        """Return the error of a fit to what is in sight; set the exponent accordingly."""
        by_fault = self.fault**2 * sums.T @ sums
        score = self.noise**2 * information + by_fault
        inverse = np.linalg.inv(information)
        wide = max(float(np.trace(inverse @ score)), 1e-12)
        # Of the likelihood with this exponent the covariance has, in the mean over axes, the right size.
        wanted = min(max(_POSE * sigma**2 / wide, _LEAST), _MOST)
        self.exponent += _FOLLOW * (wanted - self.exponent)
        return ScanError(
            covariance=inverse @ score @ inverse, fault_share=float(np.trace(inverse @ by_fault)) / wide
        )


@jit
def same_surface(points: Array, normals: Array, resolution: float) -> NDArray[np.int64]:
    """Return the number of the surface that each beam hits, shape (b,): points in line belong together.

    Args:
        points: Shape (b, 2) [m].
        normals: Of the surfaces there, shape (b, 2).
        resolution: How far off the line a point of it may be [m].
    """
    surface = np.empty(points.shape[0], dtype=np.int64)
    first = np.empty(points.shape[0], dtype=np.int64)
    count = 0
    for i in range(points.shape[0]):
        surface[i] = count
        for g in range(count):
            j = first[g]
            along = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1]
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            off = dx * normals[j, 0] + dy * normals[j, 1]
            if along > _SAME_DIRECTION and abs(off) < resolution:
                surface[i] = g
                break
        if surface[i] == count:
            first[count] = i
            count += 1
    return surface
