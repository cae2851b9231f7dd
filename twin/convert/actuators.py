"""Actuators, and the equalities by which a mimic joint follows its leader."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.convert.conversion import LedgerEntry
from twin.models.description import CommandSpec, DriveSpec, Joint, RobotDescription

WHEEL_KV = 1.0
"""Least gain of a wheel's velocity servo [Nm s/rad].

A much stiffer one takes the motors of a small robot to their limit at every new command, and then drives
anything but true.
"""
WHEEL_TIME_CONSTANT_S = 0.01
"""Within which a wheel servo, while the wheel does not slip, brings the robot's whole mass to speed [s]."""
SERVO_BANDWIDTH = 100.0
"""Natural frequency of a position servo [rad/s]: a joint sags by g/100², 1 mm, under its links' weight."""
FOLLOWER_SOLIMP = [0.99, 0.999, 0.001, 0.5, 2.0]


def add_actuators(
    spec: mujoco.MjSpec, description: RobotDescription, model: mujoco.MjModel, *, timestep: float
) -> list[LedgerEntry]:
    """Add what drives the joints; return what was chosen.

    Args:
        spec: Gets the actuators and equalities.
        description: The robot.
        model: `spec` compiled without them, for the inertia that each joint moves.
        timestep: [s]
    """
    entries = _add_wheels(spec, description)
    for command in description.commands.values():
        if spec.actuator(command.joint) is None:
            entries.append(_add_commanded(spec, description, command, model))
    for joint in description.joints.values():
        if joint.mimic is not None:
            _add_follower(spec, joint, timestep)
    return entries


def _add_wheels(spec: mujoco.MjSpec, description: RobotDescription) -> list[LedgerEntry]:
    drive = description.drive
    if drive is None:
        return []
    wheels = (*drive.left_joints, *drive.right_joints)
    gain = _wheel_gain(description, drive, len(wheels))
    for name in wheels:
        actuator = _add(spec, description.joints[name])
        actuator.set_to_velocity(gain)
        _limit_force(actuator, drive.max_wheel_torque)
        velocity = description.joints[name].limit.velocity
        if velocity:
            actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.ctrlrange = [-velocity, velocity]
    note = f"velocity actuators, gain {gain:.3g} Nm s/rad"
    return [LedgerEntry(element=f"wheels of the {drive.kind}", outcome="guessed", note=note)]


def _wheel_gain(description: RobotDescription, drive: DriveSpec, wheels: int) -> float:
    masses = [link.inertial.mass for link in description.links.values() if link.inertial is not None]
    gain = sum(masses) * drive.wheel_radius**2 / wheels / WHEEL_TIME_CONSTANT_S
    return max(WHEEL_KV, gain)


def _add_commanded(
    spec: mujoco.MjSpec, description: RobotDescription, command: CommandSpec, model: mujoco.MjModel
) -> LedgerEntry:
    joint = description.joints[command.joint]
    actuator = _add(spec, joint)
    _limit_force(actuator, joint.limit.effort)
    inertia = moved_inertia(description, joint, model)
    if command.interface == "effort":
        actuator.set_to_motor()
        note = "motor"
    elif command.interface == "velocity":
        gain = inertia / WHEEL_TIME_CONSTANT_S
        actuator.set_to_velocity(gain)
        note = f"velocity actuator, gain {gain:.3g}"
    else:
        stiffness, damping = inertia * SERVO_BANDWIDTH**2, 2.0 * inertia * SERVO_BANDWIDTH
        actuator.set_to_position(stiffness, damping)
        if joint.limit.lower is not None and joint.limit.upper is not None:
            actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.ctrlrange = [joint.limit.lower, joint.limit.upper]
        note = f"position actuator, stiffness {stiffness:.3g}, critically damped"
    element = f"command interface {command.interface} of joint '{joint.name}'"
    return LedgerEntry(
        element=element, outcome="translated", note=f"{note}; it moves {inertia:.3g} (kg or kg m²)"
    )


def moved_inertia(description: RobotDescription, joint: Joint, model: mujoco.MjModel) -> float:
    """Return the inertia [kg or kg m²] that `joint` and its followers move, at position zero, base still."""
    speed = np.zeros(model.nv)
    for other in description.joints.values():
        share, leader = 1.0, other
        while leader.mimic is not None:
            share *= leader.mimic.multiplier
            leader = description.joints[leader.mimic.joint]
        if leader.name == joint.name and other.type != "fixed":
            speed[model.joint(other.name).dofadr[0]] = share
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    momentum = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, momentum, speed)
    return float(speed @ momentum)


def _add(spec: mujoco.MjSpec, joint: Joint) -> mujoco.MjsActuator:
    return spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)


def _limit_force(actuator: mujoco.MjsActuator, effort: float | None) -> None:
    if effort:
        actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.forcerange = [-effort, effort]


def _add_follower(spec: mujoco.MjSpec, joint: Joint, timestep: float) -> None:
    assert joint.mimic is not None
    equality = spec.add_equality(
        name=f"{joint.name}_mimic",
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=joint.name,
        name2=joint.mimic.joint,
        solref=[max(0.004, 2.0 * timestep), 1.0],
        solimp=FOLLOWER_SOLIMP,
    )
    # a polynomial in the leader's position; the array's length differs between MuJoCo versions
    equality.data[:2] = joint.mimic.offset, joint.mimic.multiplier
