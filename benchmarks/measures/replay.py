"""The limit of a run: its own physics steps and rays, with its own commands, and nothing else.

A parked robot is no limit: its steps cost less than those of one that drives. So a first run, which is not
timed, notes what was written into `MjData` and into the drives of `MjModel` between two calls of `mj_step`
(commands, targets of servos, poses of obstacles, a robot that is carried elsewhere), and after which steps
who cast rays. The replay writes the same, makes the same steps, casts the same rays from the same places, and
has to end in the run's own state, bit for bit: that proves it to be the same work.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np

from twin.geometry import Array
from twin.runtime.open_run import OpenRun
from twin.sim.sensors.rays import RayCaster

_HALF_A_STEP_S = 5e-4
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_WRITTEN = (
    "ctrl",
    "act",
    "qpos",
    "qvel",
    "mocap_pos",
    "mocap_quat",
    "qfrc_applied",
    "xfrc_applied",
    "eq_active",
)
"""Of `MjData`."""
_SET = ("actuator_forcelimited", "actuator_forcerange", "actuator_dynprm")
"""Of `MjModel`."""


class Replay:
    """What a run did to its physics; made by driving it to its end."""

    def __init__(self, run: OpenRun) -> None:
        world = run.run.world
        self._model, self._data = world.model, world.data
        self._start = mujoco.MjData(self._model)
        mujoco.mj_copyData(self._start, self._model, self._data)
        self._arrays = [getattr(self._data, name) for name in _WRITTEN]
        self._arrays += [getattr(self._model, name) for name in _SET]
        self._known: list[Any] = [None] * len(self._arrays)
        self._steps: list[tuple[list[tuple[Any, Any]], int, list[RayCaster]]] = []
        """What was written before, how many steps, and who cast rays after them."""
        self._seen: Array | None = None
        """By the last cast."""
        with self._noting():
            run.advance_to_end()
        self.simulated_s = world.time_ns * 1e-9
        self._end = self._state()
        self.rewind()

    @contextmanager
    def _noting(self) -> Iterator[None]:
        step, cast = mujoco.mj_step, RayCaster.cast

        def noted_step(model: mujoco.MjModel, data: mujoco.MjData, nstep: int = 1) -> None:
            written = self._written()
            if written or not self._steps or self._steps[-1][2]:
                self._steps.append((written, nstep, []))
            else:
                self._steps[-1] = (self._steps[-1][0], self._steps[-1][1] + nstep, [])
            step(model, data, nstep)
            self._known = [array.copy() for array in self._arrays]

        def noted_cast(caster: RayCaster) -> Array:
            self._steps[-1][2].append(caster)
            self._seen = cast(caster)
            return self._seen

        with patch.object(mujoco, "mj_step", noted_step), patch.object(RayCaster, "cast", noted_cast):
            yield

    def _state(self) -> Array:
        """Return time, positions, velocities and activations."""
        state = np.empty(mujoco.mj_stateSize(self._model, _STATE))
        mujoco.mj_getState(self._model, self._data, state, _STATE)
        return state

    def _written(self) -> list[tuple[Any, Any]]:
        """Return the arrays that are not as the last step left them, each with its values."""
        pairs = zip(self._arrays, self._known, strict=True)
        return [(array, array.copy()) for array, known in pairs if not np.array_equal(array, known)]

    def rewind(self) -> None:
        """Go back to the start."""
        mujoco.mj_copyData(self._data, self._model, self._start)
        self._next, self._cast = 0, None

    def advance(self, until_s: float) -> None:
        """Do again what was done up to a simulated time [s]; inf is the end.

        Raises:
            RuntimeError: It does not end as the run did.
        """
        model, data, step = self._model, self._data, mujoco.mj_step
        while self._next < len(self._steps):
            if data.time > until_s - _HALF_A_STEP_S:
                return
            written, steps, casters = self._steps[self._next]
            self._next += 1
            for array, values in written:
                array[...] = values
            step(model, data, steps)
            if casters:
                mujoco.mj_kinematics(model, data)  # a step leaves the poses one step old
                for caster in casters:
                    self._cast = caster.cast()
        if not np.array_equal(self._state(), self._end) or not np.array_equal(self._cast, self._seen):
            raise RuntimeError("the replay does not end as the run did: a run writes what is not noted here")
