"""Forbids to change sign again and again on the spot: DWB's OscillationCritic."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.control.dwb.config import OscillationConfig


class Oscillation:
    """After a change of sign the old sign is forbidden until the robot has got somewhere."""

    def __init__(self, config: OscillationConfig) -> None:
        self.config = config
        self.reset()

    def reset(self) -> None:
        """Forget every change."""
        self._signs = [0.0, 0.0]
        self._only = [0.0, 0.0]
        self._since: Pose2 | None = None
        self._age = 0.0

    def allowed(self, samples: Array) -> NDArray[np.bool_]:
        """Return which commands (v, w), shape (n, 2), are not forbidden."""
        only = np.array(self._only)
        against: NDArray[np.bool_] = ((samples * only) < 0.0).any(axis=1)
        return ~against

    def note(self, command: tuple[float, float], pose: Pose2, dt: float) -> None:
        """Take the command that was chosen at a pose, `dt` [s] after the last one."""
        config = self.config
        axes = (0, 1) if abs(command[0]) <= config.x_only_threshold else (0,)
        changed = False
        for axis in axes:
            sign = math.copysign(1.0, command[axis]) if command[axis] else 0.0
            if sign * self._signs[axis] < 0.0:
                self._only[axis], changed = sign, True
            self._signs[axis] = sign or self._signs[axis]
        self._age += dt
        if changed:
            self._since, self._age = pose, 0.0
        elif self._since is not None and self._moved(self._since, pose):
            self.reset()

    def _moved(self, before: Pose2, now: Pose2) -> bool:
        config = self.config
        return (
            before.distance(now) > config.oscillation_reset_dist
            or abs(wrap_angle(now.yaw - before.yaw)) > config.oscillation_reset_angle
            or 0.0 <= config.oscillation_reset_time < self._age
        )
