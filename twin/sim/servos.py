"""The motor controllers of joints that are commanded by position or effort: they keep the velocity limit.

A motor controller limits the current and, in a loop of its own, the speed: a position that jumps is reached
at the joint's limit, and a joint that loses what it pressed against does not shoot off.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.savings import ALL, Savings
from twin.sim.indices import indices

_SPARE = 1.25
"""A servo's damping at the velocity limit, in effort limits: so that with the target as far ahead of a
blocked joint as the velocity limit allows, the effort limit says how hard it presses."""
_RUN_UP_S = 0.006
"""A drive is not faster at its velocity limit, all effort given [s]; at least three time steps. A lighter one
would pass the limit within one step."""
_STEEPNESS = 3.0
"""Of the edge at which a commanded effort gives way: from two thirds of the velocity limit on."""
_POSITION_INPUT, _SLEWMAX = 1, 1
"""Of MuJoCo's PID actuator: its `ctrlspec` for a position alone, and where `dynprm` has `slewmax`."""


def keep_velocity_limit(
    actuator: mujoco.MjsActuator,
    joint: mujoco.MjsJoint,
    velocity: float,
    *,
    moved: float,
    timestep: float,
) -> None:
    """Turn a position servo or a motor into one that keeps a velocity limit.

    A position servo moves its target no faster than that (MuJoCo's `pid` with `slewmax`; its activation is
    the target), and `PositionServos` keeps it near the joint. A motor becomes a velocity servo, for
    `EffortServos`.

    Args:
        actuator: Left as it is if it is a velocity servo, or a motor without an effort limit.
        joint: The actuator's; gets the inertia of a motor where the drive is too strong for what it moves.
        velocity: The limit [rad/s or m/s].
        moved: The inertia of all that the joint moves [kg or kg m²].
        timestep: [s]
    """
    limited = actuator.forcelimited == mujoco.mjtLimited.mjLIMITED_TRUE
    effort = float(actuator.forcerange[1]) if limited else 0.0
    stiffness, damping = -float(actuator.biasprm[1]), -float(actuator.biasprm[2])
    if stiffness > 0.0 and damping > 0.0:
        gain = max(1.0, _SPARE * effort / (velocity * damping))
        actuator.set_to_pid(stiffness * gain, kv=damping * gain, slewmax=velocity, ctrlspec=_POSITION_INPUT)
    elif stiffness == 0.0 and damping == 0.0 and effort > 0.0:
        actuator.set_to_velocity(_STEEPNESS * effort / velocity)
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.ctrlrange = [-velocity, velocity]
    else:
        return
    joint.armature += max(0.0, effort * max(_RUN_UP_S, 3.0 * timestep) / velocity - moved)


class PositionServos:
    """Leads the targets of position servos to what is commanded: within a tick, or at the velocity limit.

    A servo follows its target at (stiffness / damping · distance). So the target stays as near to the joint
    as that allows: one that ran ahead of a blocked joint would let it shoot off when it is free again.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        actuators: NDArray[np.intp],
        savings: Savings = ALL,
    ) -> None:
        """Bind to those of `actuators` that `keep_velocity_limit` made; changes `slewmax` in `model`."""
        self._all_qpos, self._all_qvel, self._all_act = data.qpos, data.qvel, data.act  # views, made once
        self._always = not savings.unchanged_drives
        is_kept = model.actuator_dyntype[actuators] == mujoco.mjtDyn.mjDYN_PID
        kept = actuators[is_kept]
        joints = model.actuator_trnid[kept, 0]
        self._which: list[int] = np.flatnonzero(is_kept).tolist()
        self._kept, self._target = kept, indices(model.actuator_actadr[kept])
        self._qpos, self._dof = indices(model.jnt_qposadr[joints]), indices(model.jnt_dofadr[joints])
        self._slewmax = model.actuator_dynprm[:, _SLEWMAX]
        fastest = self._slewmax[kept]
        ahead = fastest * model.actuator_biasprm[kept, 2] / model.actuator_biasprm[kept, 1]
        self._fastest: list[float] = fastest.tolist()
        self._speeds = self._fastest
        self._ahead: list[float] = ahead.tolist()
        self._time = float(data.time)

    def apply(self, commands: list[float], now: float) -> None:
        """Bound targets and the robot's commands; called once a tick, at the simulated time `now` [s]."""
        if not self._which:
            return
        elapsed, self._time = now - self._time, now
        position, velocity = self._all_qpos[self._qpos].tolist(), self._all_qvel[self._dof].tolist()
        before = self._all_act[self._target].tolist()
        targets, speeds = before.copy(), self._speeds.copy()
        # Numbers one by one: for a few joints arrays cost several times as much, and min and max again.
        for i, which in enumerate(self._which):
            here, fastest, ahead = position[i], self._fastest[i], self._ahead[i]
            target, moves, command = before[i], velocity[i], commands[which]
            least, most = here - ahead, here + ahead
            targets[i] = target = least if target < least else most if target > most else target
            # where the joint will be at the end of the tick
            there = here + elapsed * (-fastest if moves < -fastest else fastest if moves > fastest else moves)
            least, most = there - ahead, there + ahead
            commands[which] = command = least if command < least else most if command > most else command
            if elapsed > 0.0:
                speed = abs(command - target) / elapsed
                speeds[i] = fastest if fastest < speed else speed
        # An arm is at rest most of the time: what is as it was is not written again.
        if targets != before or self._always:
            self._all_act[self._target] = targets
        if speeds != self._speeds or self._always:
            self._slewmax[self._kept], self._speeds = speeds, speeds


class EffortServos:
    """Lets joints run with the effort that is commanded, up to the velocity limit."""

    def __init__(
        self,
        model: mujoco.MjModel,
        actuators: NDArray[np.intp],
        which: list[int],
        bounds: list[tuple[float | None, float | None]],
    ) -> None:
        """Bind to the effort-commanded ones of a robot's actuators.

        Args:
            model: Its force ranges are changed.
            actuators: The robot's.
            which: Of them; what `keep_velocity_limit` left as a motor is left out.
            bounds: Least and largest command of each; None where there is no bound [N or Nm].
        """
        chosen = np.array(which, dtype=np.intp)
        made = model.actuator_biastype[actuators[chosen]] != mujoco.mjtBias.mjBIAS_NONE
        self._which: list[int] = chosen[made].tolist()
        self._limits = model.actuator_forcerange
        self._actuators = actuators[self._which]
        self._velocity = model.actuator_ctrlrange[self._actuators, 1]
        effort = self._limits[self._actuators, 1]
        given = np.array(bounds, dtype=np.float64).reshape(-1, 2)[made]  # None is NaN, which fmax passes over
        self._least: Array = np.fmax(given[:, 0], -effort)
        self._most: Array = np.fmin(given[:, 1], effort)
        self._bounds = self._least.copy(), self._most.copy()

    def limit(self, actuator: int, effort: float) -> None:
        """Bound one more narrowly [N or Nm], or as it was; `actuator` of the robot's."""
        if actuator in self._which:
            i = self._which.index(actuator)
            self._least[i], self._most[i] = (float(np.clip(own[i], -effort, effort)) for own in self._bounds)

    def apply(self, commands: list[float]) -> None:
        """Turn efforts, of the robot's commands, into velocities; called once a tick."""
        if not self._which:
            return
        effort = np.clip([commands[which] for which in self._which], self._least, self._most)
        self._limits[self._actuators, 0] = -abs(effort)
        self._limits[self._actuators, 1] = abs(effort)
        for which, velocity in zip(self._which, np.copysign(self._velocity, effort).tolist(), strict=True):
            commands[which] = velocity
