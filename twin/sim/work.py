"""The mechanical work of robots' actuators: the truth, for checks."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

_ROWS = 128
"""States that are noted before they are added up."""


class WorkMeter:
    """Adds up force times velocity of every actuated joint, physics step by physics step, where positive.

    A servo that gets a command every control tick accelerates and brakes within the tick: samples at the
    tick's end would miss most of it.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[str]) -> None:
        """Bind to a model, at the start."""
        self._force, self._velocity = data.qfrc_actuator, data.qvel  # views, made once: this is the hot loop
        self._half_step = 0.5 * float(model.opt.timestep)
        on_joints = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
        joints = sorted(set(model.actuator_trnid[on_joints, 0].tolist()))
        owners = [model.joint(joint).name.partition("/")[0] for joint in joints]
        self._dofs = model.jnt_dofadr[joints]
        self._of = {robot: np.array([owner == robot for owner in owners], dtype=bool) for robot in robots}
        self._work = np.zeros(len(joints))
        # A row for the state before physics steps, then one for each; row, first row of these steps.
        self._forces, self._velocities = np.zeros((_ROWS, model.nv)), np.zeros((_ROWS, model.nv))
        self._row = self._first = 0
        self._noted: list[tuple[int, int]] = []

    def begin(self, steps: int) -> None:
        """Note the state before so many physics steps."""
        if self._row + steps >= len(self._forces):
            self._add_up()
        if steps >= len(self._forces):
            self._forces, self._velocities = (np.zeros((steps + 1, len(self._force))) for _ in range(2))
        self._first = self._row
        self._velocities[self._row] = self._velocity

    def note(self) -> None:
        """Note a physics step."""
        self._row += 1
        self._forces[self._row] = self._force
        self._velocities[self._row] = self._velocity

    def end(self) -> None:
        """Note that these were all."""
        self._noted.append((self._first, self._row))
        self._row += 1

    def _add_up(self) -> None:
        """Add up what was noted; that of several calls together costs little more than that of one."""
        velocities = self._velocities[: self._row, self._dofs]
        powers = self._forces[1 : self._row, self._dofs] * (velocities[:-1] + velocities[1:])
        np.maximum(powers, 0.0, out=powers)
        for first, last in self._noted:
            self._work += self._half_step * powers[first:last].sum(axis=0)
        self._row = 0
        self._noted.clear()

    def work(self, robot: str) -> float:
        """Return the work of a robot's actuators since the start [J]."""
        self._add_up()
        return float(self._work[self._of[robot]].sum())
