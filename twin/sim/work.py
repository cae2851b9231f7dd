"""The mechanical work of robots' actuators: the truth, for checks."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from twin.geometry import Array

_MOST = 128
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
        # The state before physics steps, then that after each, as bytes: nothing copies an array for less.
        self._forces: list[bytes] = []
        self._velocities: list[bytes] = []
        self._noted: list[tuple[int, int]] = []
        """Of the calls: where each began, and its last state."""

    def begin(self, steps: int) -> None:
        """Note the state before so many physics steps."""
        noted = len(self._forces)
        if noted + steps >= _MOST:
            self._add_up()
            noted = 0
        self._noted.append((noted, noted + steps))
        self.note()

    def note(self) -> None:
        """Note the state after a physics step."""
        self._forces.append(self._force.tobytes())
        self._velocities.append(self._velocity.tobytes())

    def _add_up(self) -> None:
        """Add up what was noted; that of several calls together costs little more than that of one."""
        if not self._noted:
            return
        forces, velocities = self._of_drives(self._forces), self._of_drives(self._velocities)
        powers = forces[1:] * (velocities[:-1] + velocities[1:])
        np.maximum(powers, 0.0, out=powers)
        for first, last in self._noted:
            self._work += self._half_step * np.add.reduce(powers[first:last])
        for noted in (self._forces, self._velocities, self._noted):
            noted.clear()

    def _of_drives(self, noted: list[bytes]) -> Array:
        """Return of every state what belongs to the joints that are driven, shape (states, joints)."""
        return np.frombuffer(b"".join(noted)).reshape(len(noted), -1)[:, self._dofs]

    def work(self, robot: str) -> float:
        """Return the work of a robot's actuators since the start [J]."""
        self._add_up()
        return float(self._work[self._of[robot]].sum())
