"""How a skid-steered robot turns: all wheels slip, and the least friction power decides by how much."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array

_SMOOTHING = np.geomspace(1.0, 1e-9, 28)
"""Of the friction's corner at zero slip, as a share of the wheels' speed; each solution starts the next."""
_NEWTON_STEPS = 60
_CORNERING = 0.1
"""At this share of the friction cornering is looked at: shift and gain are the same up to twice as much."""


def track_ratio(
    wheels_xy: ArrayLike, is_left: ArrayLike, separation: float, shares: ArrayLike | None = None
) -> float:
    """Return effective over geometric track: by how much a robot turns slower than two wheels would.

    Under isotropic Coulomb friction, forces and torque balance where the friction power, the sum of slip
    speeds times loads, has its minimum over the robot's velocity. That is independent of friction and speed.
    For four wheels at (±a, ±b) with equal loads it gives 1 + (a/b)², for two wheels 1.

    Args:
        wheels_xy: Contact points in the robot's frame, x forward, shape (n, 2) [m].
        is_left: Which of them are on the left, shape (n,).
        separation: Distance of the left and right wheels by which commands are made [m].
        shares: Of the robot's weight on each wheel, shape (n,); None for equal loads.
    """
    xy = np.asarray(wheels_xy, dtype=float)
    weights = np.full(len(xy), 1.0 / len(xy)) if shares is None else np.asarray(shares, dtype=float)
    rolling = np.where(np.asarray(is_left, dtype=bool), -1.0, 1.0)
    scale = float(np.max(np.abs(xy)))
    turn = _least_friction(xy / scale, rolling, weights)[2]
    return 2.0 * scale / (turn * separation)


class CorneringSlip(NamedTuple):
    """What the centrifugal force does to a skid steer, whose tyres slide in every turn anyway.

    With q the centripetal acceleration as a share of what friction can hold (μg), the robot slides outwards
    at `side_shift` q times its yaw rate, and turns faster than on the spot by the share `turn_gain` q².
    MuJoCo's jackal and sp1s do so within a third.
    """

    side_shift: float
    """[m]"""
    turn_gain: float


def cornering_slip(
    wheels_xy: ArrayLike, is_left: ArrayLike, shares: ArrayLike, height: float, friction: float
) -> CorneringSlip:
    """Return how far cornering leads a skid steer off what its wheels tell, by the least friction power.

    Args:
        wheels_xy: Contact points in the robot's frame, x forward, shape (n, 2) [m].
        is_left: Which of them are on the left, shape (n,).
        shares: Of the robot's weight on each wheel, shape (n,).
        height: Of the centre of mass above the ground [m].
        friction: Coulomb's coefficient.
    """
    xy, left = np.asarray(wheels_xy, dtype=float), np.asarray(is_left, dtype=bool)
    weights, scale = np.asarray(shares, dtype=float), float(np.max(np.abs(xy)))
    rolling = np.where(left, -1.0, 1.0)
    still = _least_friction(xy / scale, rolling, weights)
    # A turn to the left loads the wheels on the right.
    width = float(xy[left, 1].mean() - xy[~left, 1].mean())
    moved = _CORNERING * friction * height / width
    loaded = np.maximum(weights + moved * np.where(left, -1.0 / left.sum(), 1.0 / (~left).sum()), 0.0)
    turning = _least_friction(xy / scale, rolling, loaded, outwards=_CORNERING)
    shift = scale * (still[1] / still[2] - turning[1] / turning[2])
    return CorneringSlip(
        side_shift=float(shift) / _CORNERING,
        turn_gain=max(float(turning[2] / still[2]) - 1.0, 0.0) / _CORNERING**2,
    )


def weight_shares(wheels_xy: ArrayLike, centre_of_mass: ArrayLike) -> Array:
    """Return each wheel's share of the weight, shape (n,), as equal springs under a rigid body share it.

    Two wheels share evenly: what casters carry is not known.

    Args:
        wheels_xy: Contact points, shape (n, 2) [m].
        centre_of_mass: In the same frame, shape (2,) [m].
    """
    xy = np.asarray(wheels_xy, dtype=float)
    middle = xy.mean(axis=0)
    balance = np.vstack([np.ones(len(xy)), (xy - middle).T])
    wanted = np.concatenate([[1.0], np.asarray(centre_of_mass, dtype=float) - middle])
    return np.maximum(np.linalg.lstsq(balance, wanted, rcond=None)[0], 0.0)


def _least_friction(xy: Array, rolling: Array, weights: Array, *, outwards: float = 0.0) -> Array:
    """Return (vx, vy, yaw rate) at rolling speeds ±1 that minimises the weighted sum of slip speeds.

    A force to the right, of so much of the friction as `outwards` says, works along.

    Newton's method on sqrt(slip² + ε²), which is convex, with ε taken to zero; where a wheel sticks, the
    minimum has a corner.
    """
    n = len(xy)
    by_velocity = np.zeros((n, 2, 3))  # slip per (vx, vy, yaw rate)
    by_velocity[:, 0, 0] = by_velocity[:, 1, 1] = 1.0
    by_velocity[:, 0, 2], by_velocity[:, 1, 2] = -xy[:, 1], xy[:, 0]
    own = np.stack([rolling, np.zeros(n)], axis=1)

    def power(velocity: Array, smooth: float) -> float:
        slip = by_velocity @ velocity - own
        return float(weights @ np.sqrt(np.sum(slip**2, axis=1) + smooth**2) + outwards * velocity[1])

    velocity = np.array([0.0, 0.0, 1.0])
    for smooth in _SMOOTHING:
        for _ in range(_NEWTON_STEPS):
            slip = by_velocity @ velocity - own
            length = np.sqrt(np.sum(slip**2, axis=1) + smooth**2)
            direction = slip / length[:, None]
            gradient = np.einsum("n,nij,ni->j", weights, by_velocity, direction)
            gradient[1] += outwards
            across = (np.eye(2) - direction[:, :, None] * direction[:, None, :]) / length[:, None, None]
            hessian = np.einsum("n,nij,nik,nkl->jl", weights, by_velocity, across, by_velocity)
            step = np.linalg.lstsq(hessian, -gradient, rcond=None)[0]
            share, before = 1.0, power(velocity, smooth)
            while power(velocity + share * step, smooth) > before and share > 1e-6:
                share /= 2.0
            velocity = velocity + share * step
            if np.max(np.abs(share * step)) < 1e-13:
                break
    return velocity
