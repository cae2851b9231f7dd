"""Notice that the physics has diverged, keep what led to it, and say which part did it."""

from __future__ import annotations

import math
from collections import deque
from pathlib import Path

import mujoco
import numpy as np

from twin.convert import mujoco_log as mujoco_log
from twin.errors import SimulationError
from twin.geometry import Array

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)  # to convert an enum takes longer than to copy
_BAD = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)

_WHAT = ("position", "velocity", "acceleration")


class DivergenceGuard:
    """A rolling memory of the last states, written to a file when the physics cannot go on."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, *, capacity: int = 50) -> None:
        self._model = model
        self._data = data
        self._warnings = [data.warning[kind] for kind in _BAD]
        counts = data.warning.number
        self._bad = counts[_BAD[0] : _BAD[-1] + 1]  # a view: to ask for each number takes longer
        self._none, self._velocity = self._bad.tobytes(), data.qvel
        self._size = mujoco.mj_stateSize(model, _STATE)
        self._states = deque[Array](maxlen=capacity)
        """The states kept, oldest first."""

    def remember(self) -> None:
        """Keep the present state."""
        is_full = len(self._states) == self._states.maxlen
        state = self._states.popleft() if is_full else np.empty(self._size)
        mujoco.mj_getState(self._model, self._data, state, _STATE)
        self._states.append(state)

    def check(self, folder: Path | None) -> None:
        """Do nothing if the state is finite.

        Args:
            folder: Where to write `diverged.npz`; None writes nothing.

        Raises:
            SimulationError: Names the joint or body at fault, the time, and the file.
        """
        # A number that is not finite makes the sum one, too.
        if self._bad.tobytes() == self._none and math.isfinite(sum(self._velocity.tolist())):
            return
        what, part = self._replay()
        time = self._data.time
        message = f"the physics diverged at t = {time:.3f} s: the {what} of {part} is not finite or too large"
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            file = folder / "diverged.npz"
            states = np.array(self._states)
            np.savez(file, states=states, times=states[:, 0], state_spec=_STATE)
            message += f"; the last {len(states)} states are in {file}"
        hint = "check masses, inertias and commands there, or take a smaller physics step"
        raise SimulationError(f"{message}; {hint}")

    def _replay(self) -> tuple[str, str]:
        """Step singly from the last good state to find the first bad number; remembers each step's state."""
        model, data = self._model, self._data
        mujoco.mj_setState(model, data, self._states[-1], _STATE)
        for warning in self._warnings:
            warning.number = 0
        for _ in range(10_000):
            mujoco.mj_step(model, data)
            for warning, what in zip(self._warnings, _WHAT, strict=True):
                if warning.number:
                    return what, _describe(model, self._worst_joint(warning, what))
            self.remember()
        return "state", "the world"

    def _worst_joint(self, warning: mujoco.MjWarningStat, what: str) -> int:
        """Return the joint that moves worst; MuJoCo names the first bad one, perhaps only dragged along."""
        model, data = self._model, self._data
        if what == "position":
            return int(np.searchsorted(model.jnt_qposadr, warning.lastinfo, side="right")) - 1
        values = np.abs(data.qvel if what == "velocity" else data.qacc)
        worst = int(np.argmax(values)) if np.isfinite(values).all() else warning.lastinfo
        return int(model.dof_jntid[worst])


def _describe(model: mujoco.MjModel, joint: int) -> str:
    body = model.body(model.jnt_bodyid[joint]).name
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
        return f"body '{body}'"
    return f"joint '{model.joint(joint).name}' (body '{body}')"
