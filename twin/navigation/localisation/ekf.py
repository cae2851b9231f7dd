"""An extended Kalman filter over a robot's motion, with robot_localization's state and parameters.

State of 15, in its order: x, y, z, roll, pitch, yaw in the world frame [m, rad]; their velocities and the
linear accelerations in the base frame [m/s, rad/s, m/s²].
Source: Moore and Stouch, A generalized extended Kalman filter implementation for ROS, IAS-13, 2014.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array
from twin.parameters import Interval

SIZE = 15
X, Y, Z, ROLL, PITCH, YAW, VX, VY, VZ, VROLL, VPITCH, VYAW, AX, AY, AZ = range(SIZE)
POSITION, ANGLES = slice(X, Z + 1), slice(ROLL, YAW + 1)
VELOCITY, RATES, ACCELERATION = slice(VX, VZ + 1), slice(VROLL, VYAW + 1), slice(AX, AZ + 1)
OUT_OF_PLANE = (Z, ROLL, PITCH, VZ, VROLL, VPITCH, AZ)
"""What a robot on a flat floor does not have."""

Covariance = tuple[Annotated[float, Interval(ge=-1e9, le=1e9)], ...]
_LEAST_VARIANCE = 1e-9
_FLAT_VARIANCE = 1e-6


@dataclass(frozen=True, kw_only=True)
class EkfConfig:
    """Parameters; names and defaults are robot_localization's, matrices their diagonals, or whole by rows."""

    two_d_mode: bool = False
    """Whether z, roll, pitch and what moves along them stay zero."""
    process_noise_covariance: Covariance = (
        *(0.05, 0.05, 0.06, 0.03, 0.03, 0.06),
        *(0.025, 0.025, 0.04, 0.01, 0.01, 0.02),
        *(0.01, 0.01, 0.015),
    )
    """Variances that the states gain per second, 15 or a 15 x 15 matrix by rows."""
    initial_estimate_covariance: Covariance = (1e-9,) * SIZE
    """The same at the start."""

    def __post_init__(self) -> None:
        for name in ("process_noise_covariance", "initial_estimate_covariance"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if len(values) not in (SIZE, SIZE * SIZE) or not np.isfinite(values).all():
                raise ValueError(f"{name} must be {SIZE} numbers, or {SIZE}² of a matrix by rows")
            matrix = _matrix(values)
            if np.linalg.eigvalsh(matrix).min() < -1e-12 or np.abs(matrix - matrix.T).max() > 1e-12:
                raise ValueError(f"{name} must be a covariance: symmetric, no variance negative")


class Ekf:
    """Predicts with constant acceleration in the base frame, and corrects with measured states."""

    def __init__(self, config: EkfConfig | None = None) -> None:
        self.config = config or EkfConfig()
        self.state: Array = np.zeros(SIZE)
        self.covariance: Array = _matrix(self.config.initial_estimate_covariance)
        """Of the state, shape (15, 15)."""
        self._process = _matrix(self.config.process_noise_covariance)
        self._flatten()

    def set_pose(self, xyz_rpy: ArrayLike, covariance: ArrayLike) -> None:
        """Start again from a pose, shape (6,), and its covariance, shape (6, 6); the robot stands still."""
        self.state[:] = 0.0
        self.state[:6] = xyz_rpy
        self.covariance = _matrix(self.config.initial_estimate_covariance)
        self.covariance[:6, :6] = covariance
        self._flatten()

    def predict(self, dt: float) -> None:
        """Advance by `dt` [s]; nothing happens for 0 and less."""
        if dt <= 0.0:
            return
        F = self._jacobian(dt)
        self.state = advanced(self.state, dt)
        self.covariance = F @ self.covariance @ F.T + dt * self._process
        self._flatten()

    def doubt(self, index: int, variance: float) -> None:
        """Be less sure of a state, by a variance that no measurement told."""
        self.covariance[index, index] += variance

    def correct(
        self,
        indices: Sequence[int],
        values: ArrayLike,
        covariance: ArrayLike,
        *,
        threshold: float = np.inf,
    ) -> bool:
        """Take in a measurement of some states; return whether it was used.

        Values that are not finite are left out; negative variances count by their size, as theirs do.

        Args:
            indices: Which states, n of them.
            values: Shape (n,).
            covariance: Shape (n, n).
            threshold: Mahalanobis distance beyond which it is refused.
        """
        z, R = np.asarray(values, dtype=np.float64), np.asarray(covariance, dtype=np.float64)
        chosen = np.flatnonzero(np.isfinite(z) & np.isfinite(np.diag(R)))
        if not len(chosen):
            return False
        states = np.asarray(indices)[chosen]
        R = R[np.ix_(chosen, chosen)].copy()
        np.fill_diagonal(R, np.maximum(np.abs(np.diag(R)), _LEAST_VARIANCE))
        innovation = z[chosen] - self.state[states]
        angles = (states >= ROLL) & (states <= YAW)
        innovation[angles] = _wrapped(innovation[angles])
        PH = self.covariance[:, states]
        S = PH[states] + R
        if np.sqrt(max(float(innovation @ np.linalg.solve(S, innovation)), 0.0)) > threshold:
            return False
        K = np.linalg.solve(S, PH.T).T
        self.state = self.state + K @ innovation
        self.state[ANGLES] = _wrapped(self.state[ANGLES])
        left = np.eye(SIZE)
        left[:, states] -= K
        # Joseph's form stays symmetric and positive.
        self.covariance = left @ self.covariance @ left.T + K @ R @ K.T
        self._flatten()
        return True

    def _flatten(self) -> None:
        if not self.config.two_d_mode:
            return
        flat = list(OUT_OF_PLANE)
        self.state[flat] = 0.0
        self.covariance[flat, :] = 0.0
        self.covariance[:, flat] = 0.0
        self.covariance[flat, flat] = _FLAT_VARIANCE

    def _jacobian(self, dt: float) -> Array:
        """Return the derivative of `advanced` by the state, shape (15, 15)."""
        roll, pitch, yaw = self.state[ANGLES]
        moved = dt * self.state[VELOCITY] + 0.5 * dt * dt * self.state[ACCELERATION]
        R, by_roll, by_pitch, by_yaw = _rotation_and_derivatives(roll, pitch, yaw)
        F = np.eye(SIZE)
        F[POSITION, VELOCITY], F[POSITION, ACCELERATION] = dt * R, 0.5 * dt * dt * R
        F[POSITION, ANGLES] = np.column_stack([by_roll @ moved, by_pitch @ moved, by_yaw @ moved])
        F[ANGLES, RATES] = dt * _rates_to_angles(roll, pitch)
        _, q, r = self.state[RATES]
        sr, cr, tp, cp = np.sin(roll), np.cos(roll), np.tan(pitch), np.cos(pitch)
        across, along = q * cr - r * sr, q * sr + r * cr
        F[ANGLES, ROLL] += dt * np.array([across * tp, -along, across / cp])
        F[ANGLES, PITCH] += dt * np.array([along / cp**2, 0.0, along * tp / cp])
        F[VELOCITY, ACCELERATION] = dt * np.eye(3)
        return F


def _matrix(values: ArrayLike) -> Array:
    """Return a square matrix of its diagonal, or of all its numbers by rows."""
    numbers = np.asarray(values, dtype=np.float64)
    return np.diag(numbers) if len(numbers) == SIZE else numbers.reshape(SIZE, SIZE).copy()


def advanced(state: Array, dt: float) -> Array:
    """Return the state, shape (15,), `dt` [s] later if nothing accelerates further."""
    roll, pitch, yaw = state[ANGLES]
    later = state.copy()
    R = _rotation_and_derivatives(roll, pitch, yaw)[0]
    later[POSITION] += R @ (dt * state[VELOCITY] + 0.5 * dt * dt * state[ACCELERATION])
    later[ANGLES] = _wrapped(later[ANGLES] + dt * _rates_to_angles(roll, pitch) @ state[RATES])
    later[VELOCITY] += dt * state[ACCELERATION]
    return later


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Return the matrix, shape (3, 3), that takes a vector of the base frame to the world frame (REP-103)."""
    return _rotation_and_derivatives(roll, pitch, yaw)[0]


def _rotation_and_derivatives(roll: float, pitch: float, yaw: float) -> tuple[Array, Array, Array, Array]:
    """Return Rz Ry Rx, and its derivatives by roll, pitch and yaw."""
    (sr, cr), (sp, cp), (sy, cy) = ((np.sin(a), np.cos(a)) for a in (roll, pitch, yaw))
    Rx = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    Ry = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    Rz = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    dRx = np.array([[0.0, 0.0, 0.0], [0.0, -sr, -cr], [0.0, cr, -sr]])
    dRy = np.array([[-sp, 0.0, cp], [0.0, 0.0, 0.0], [-cp, 0.0, -sp]])
    dRz = np.array([[-sy, -cy, 0.0], [cy, -sy, 0.0], [0.0, 0.0, 0.0]])
    return Rz @ Ry @ Rx, Rz @ Ry @ dRx, Rz @ dRy @ Rx, dRz @ Ry @ Rx


def _rates_to_angles(roll: float, pitch: float) -> Array:
    """Return the matrix, shape (3, 3), from turn rates of the base to rates of roll, pitch and yaw."""
    sr, cr, tp, cp = np.sin(roll), np.cos(roll), np.tan(pitch), np.cos(pitch)
    return np.array([[1.0, sr * tp, cr * tp], [0.0, cr, -sr], [0.0, sr / cp, cr / cp]])


def _wrapped(angles: Array) -> Array:
    return np.asarray(angles - 2.0 * np.pi * np.round(angles / (2.0 * np.pi)))
