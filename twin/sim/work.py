"""The mechanical work of robots' actuators: the truth, for checks."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from twin.geometry import Array


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
        self._forces: list[Array] = []
        self._velocities: list[Array] = []

    def begin(self) -> None:
        """Note the state before physics steps."""
        self._forces, self._velocities = [], [self._velocity.copy()]

    def note(self) -> None:
        """Note a physics step."""
        self._forces.append(self._force.copy())
        self._velocities.append(self._velocity.copy())

    def end(self) -> None:
        """Add up what was noted since `begin`."""
        velocities = np.array(self._velocities)[:, self._dofs]
        powers = np.array(self._forces)[:, self._dofs] * (velocities[:-1] + velocities[1:])
        self._work += self._half_step * np.maximum(powers, 0.0).sum(axis=0)

    def work(self, robot: str) -> float:
        """Return the work of a robot's actuators since the start [J]."""
        return float(self._work[self._of[robot]].sum())
