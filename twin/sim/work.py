"""The mechanical work of robots' actuators: the truth, for checks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import mujoco
import numpy as np

_MOST = 256
"""Arrays that are noted before they are added up."""


class StepMeter(Protocol):
    """What sees the state before and after every physics step."""

    def begin(self, steps: int) -> None:
        """See the state before so many physics steps."""

    def note(self) -> None:
        """See the state after a physics step."""

    def work(self, robot: str) -> float:
        """Return the work of a robot's actuators since the start [J]."""


class StepWatch:
    """Calls back after every physics step, for tools that look into a run; wraps the meter that there is."""

    def __init__(self, callback: Callable[[], None], meter: StepMeter | None) -> None:
        self._callback, self._meter = callback, meter

    def begin(self, steps: int) -> None:
        """Pass on."""
        if self._meter is not None:
            self._meter.begin(steps)

    def note(self) -> None:
        """Call back."""
        if self._meter is not None:
            self._meter.note()
        self._callback()

    def work(self, robot: str) -> float:
        """Pass on; 0 if nobody measures."""
        return 0.0 if self._meter is None else self._meter.work(robot)


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
        dofs = model.jnt_dofadr[joints]
        self._of = {robot: dofs[[owner == robot for owner in owners]] for robot in robots}
        self._work = np.zeros(model.nv)
        # Force and velocity before physics steps, then after each: as bytes an array is copied for least.
        self._noted: list[bytes] = []
        self._steps, self._arrays = 0, 2
        """Of each call whose states are noted."""

    def begin(self, steps: int) -> None:
        """Note the state before so many physics steps."""
        noted = len(self._noted)
        if steps != self._steps or noted >= _MOST or noted % self._arrays:
            self._add_up()
            self._steps, self._arrays = steps, 2 * (steps + 1)
        self.note()

    def note(self) -> None:
        """Note the state after a physics step."""
        self._noted += (self._force.tobytes(), self._velocity.tobytes())

    def _add_up(self) -> None:
        """Add up what was noted; that of several calls together costs little more than that of one."""
        whole = len(self._noted) - len(self._noted) % self._arrays  # without a call that was interrupted
        states = np.frombuffer(b"".join(self._noted[:whole]))
        states = states.reshape(whole // self._arrays, self._steps + 1, 2, len(self._force))
        velocities = states[:, :, 1]  # shape (calls, states, nv)
        powers = states[:, 1:, 0] * (velocities[:, :-1] + velocities[:, 1:])
        np.maximum(powers, 0.0, out=powers)
        for work in self._half_step * np.add.reduce(powers, axis=1):
            self._work += work
        self._noted.clear()

    def work(self, robot: str) -> float:
        """Return the work of a robot's actuators since the start [J]."""
        self._add_up()
        return float(self._work[self._of[robot]].sum())
