"""The commands that were sent last, at multiples of the model's time step."""

from __future__ import annotations

import numpy as np

from twin.navigation.control.footprint_cover import F32


class SentCommands:
    """Commands come once per control period; the model looks back in steps of its own."""

    def __init__(self, steps: int, model_dt: float) -> None:
        """Look `steps` steps of `model_dt` [s] back; before the first command the robot stood."""
        # A rounding error is no reason to take the command before.
        self._ages = np.arange(steps, 0, -1) * model_dt * (1.0 - 1e-9)
        self._periods = np.zeros(0)
        self._commands = np.zeros((2, 0), dtype=np.float32)

    def add(self, command: tuple[float, float], period: float) -> None:
        """Take a command (v [m/s], w [rad/s]) that holds for one control period [s]."""
        self._periods = np.concatenate([[period], self._periods])
        self._commands = np.concatenate(
            [np.array(command, dtype=np.float32)[:, None], self._commands], axis=1
        )
        kept = int(np.searchsorted(np.cumsum(self._periods), self._ages[0])) + 1
        self._periods, self._commands = self._periods[:kept], self._commands[:, :kept]

    def latest(self, steps: int) -> F32:
        """Return what held `steps`, ..., 2, 1 steps before the next command, shape (2, steps)."""
        at = np.searchsorted(np.cumsum(self._periods), self._ages[len(self._ages) - steps :])
        standing = np.zeros((2, 1), dtype=np.float32)
        known = np.concatenate([self._commands, standing], axis=1)
        return np.ascontiguousarray(known[:, np.minimum(at, known.shape[1] - 1)])
