"""Joint trajectories: smooth point-to-point moves and sampling between way-points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array


@dataclass(frozen=True, kw_only=True)
class JointLimits:
    """Motion limits of one joint; SI units."""

    lower: float
    upper: float
    max_velocity: float
    max_acceleration: float


@dataclass(frozen=True)
class Trajectory:
    """Way-points in time, all joints at rest at both ends."""

    joint_names: tuple[str, ...]
    times: Array
    """[s] from the start, shape (n,), increasing, first 0."""
    positions: Array
    """shape (n, joints)"""
    velocities: Array
    """shape (n, joints)"""

    @property
    def duration(self) -> float:
        """Time from the first to the last way-point [s]."""
        return float(self.times[-1])

    def sample(self, time: float) -> Array:
        """Return positions, shape (joints,), at `time` [s]: cubic Hermite inside, held outside."""
        if time <= 0.0:
            return np.array(self.positions[0])
        if time >= self.times[-1]:
            return np.array(self.positions[-1])
        i = int(self.times.searchsorted(time, side="right")) - 1
        begin, end = self.times[i : i + 2].tolist()
        h = end - begin
        s = (time - begin) / h
        # Numbers one by one: for a few joints arrays cost several times as much.
        ends = zip(*self.positions[i : i + 2].tolist(), *self.velocities[i : i + 2].tolist(), strict=True)
        s2, s3 = s * s, s * s * s
        a, b, c, d = 2 * s3 - 3 * s2 + 1, (s3 - 2 * s2 + s) * h, 3 * s2 - 2 * s3, (s3 - s2) * h
        return np.array([a * p0 + b * v0 + c * p1 + d * v1 for p0, p1, v0, v1 in ends])


def plan_joint_move(
    start: Mapping[str, float],
    goal: Mapping[str, float],
    limits: Mapping[str, JointLimits],
    *,
    speed: float = 1.0,
    step: float = 0.05,
) -> Trajectory:
    """Return a straight move in joint space: all joints start and stop together, each within its limits.

    Args:
        start: Position of each joint of `goal`; others are ignored.
        goal: Position to reach.
        limits: Limits of each joint of `goal`.
        speed: Fraction of the allowed velocity, (0, 1].
        step: Spacing of the way-points [s].

    Raises:
        ValueError: A goal is outside its joint's range; the text names joint, value and range.
    """
    names = tuple(goal)
    for name in names:
        lim = limits[name]
        if not lim.lower - 1e-6 <= goal[name] <= lim.upper + 1e-6:
            raise ValueError(
                f"joint '{name}' cannot reach {goal[name]:.3f}; "
                f"its range is {lim.lower:.3f} … {lim.upper:.3f}"
            )
    p0 = np.array([start[name] for name in names])
    p1 = np.array([goal[name] for name in names])
    velocity = np.array([limits[name].max_velocity * speed for name in names])
    acceleration = np.array([limits[name].max_acceleration for name in names])
    span = np.abs(p1 - p0)
    if not np.any(span > 1e-9):
        return Trajectory(names, np.array([0.0]), p1[None], np.zeros((1, len(names))))
    # Quintic blend: for a unit move in unit time its speed peaks at 1.875, its acceleration at 5.7735.
    duration = max(
        float(np.max(1.875 * span / velocity)), float(np.max(np.sqrt(5.7735 * span / acceleration)))
    )
    times = np.linspace(0.0, duration, max(2, math.ceil(duration / step) + 1))
    s = times / duration
    blend = 10 * s**3 - 15 * s**4 + 6 * s**5
    rate = (30 * s**2 - 60 * s**3 + 30 * s**4) / duration
    return Trajectory(names, times, p0 + blend[:, None] * (p1 - p0), rate[:, None] * (p1 - p0))


def concatenate(
    names: Sequence[str], times: Sequence[float], positions: Sequence[Sequence[float]]
) -> Trajectory:
    """Return a trajectory through way-points, with Catmull-Rom velocities inside and rest at both ends."""
    t = np.asarray(times, dtype=np.float64)
    p = np.asarray(positions, dtype=np.float64).reshape(len(t), len(names))
    v = np.zeros_like(p)
    if len(t) > 2:
        v[1:-1] = (p[2:] - p[:-2]) / (t[2:] - t[:-2])[:, None]
    return Trajectory(tuple(names), t, p, v)
