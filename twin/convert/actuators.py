"""Actuators, and the equalities by which a mimic joint follows its leader."""

from __future__ import annotations

import math
from collections.abc import Mapping

import mujoco
import numpy as np

from twin.convert.bodies import LEAST_RANGE
from twin.convert.contact_roles import commanded_wheels
from twin.convert.conversion import Guess
from twin.models.checks.wheels import Wheel
from twin.models.description import Joint, RobotDescription
from twin.models.kinematics import ONE_DOF
from twin.models.specs import CommandSpec
from twin.models.urdf.document import LARGEST

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
    spec: mujoco.MjSpec, description: RobotDescription, moved: Mapping[str, float], *, timestep: float
) -> list[Guess]:
    """Add what drives the joints; return what was chosen.

    Args:
        spec: Gets the actuators and equalities.
        description: The robot.
        moved: The inertia that each commanded joint moves, from `moved_inertia`.
        timestep: [s]
    """
    guesses = _add_wheels(spec, description)
    for command in description.commands.values():
        if spec.actuator(command.joint) is None:
            guesses += _add_commanded(spec, description, command, moved[command.joint])
    for joint in description.joints.values():
        if joint.mimic is not None and joint.type in ONE_DOF:
            leader = description.joints[joint.mimic.joint]
            _add_follower(spec, joint, timestep, leader=leader.name if leader.type in ONE_DOF else "")
    return guesses


def _add_wheels(spec: mujoco.MjSpec, description: RobotDescription) -> list[Guess]:
    wheels = commanded_wheels(description)
    if not wheels:
        return []
    drive = description.drive
    gain = _wheel_gain(description, wheels)
    for wheel in wheels:
        joint = wheel.joint
        driven = drive is not None and joint.name in (*drive.left_joints, *drive.right_joints)
        actuator = _add(spec, joint)
        actuator.set_to_velocity(gain)
        _limit_force(actuator, drive.max_wheel_torque if drive and driven else joint.limit.effort)
        speed = joint.limit.velocity
        _limit_command(actuator, description.commands.get(joint.name), *((-speed, speed) if speed else ()))
    of = "commanded wheels" if drive is None else f"wheels of the {drive.kind}"
    return [Guess(element=of, note=f"velocity actuators, gain {gain:.3g} Nm s/rad")]


def _wheel_gain(description: RobotDescription, wheels: tuple[Wheel, ...]) -> float:
    radius = max(wheel.radius for wheel in wheels)
    return max(WHEEL_KV, description.mass * radius**2 / len(wheels) / WHEEL_TIME_CONSTANT_S)


def _add_commanded(
    spec: mujoco.MjSpec, description: RobotDescription, command: CommandSpec, inertia: float
) -> list[Guess]:
    joint = description.joints[command.joint]
    limit = joint.limit
    actuator = _add(spec, joint)
    # The file's limit is of each joint; a drive that others follow has to move them all.
    _limit_force(actuator, limit.effort and limit.effort * drive_ratio(description, joint.name))
    if actuator.forcelimited == mujoco.mjtLimited.mjLIMITED_TRUE:
        spec.joint(joint.name).actfrcrange = actuator.forcerange
    if command.interface == "effort":
        actuator.set_to_motor()
        _limit_command(actuator, command)
        return []
    if command.interface == "velocity":
        gain = inertia / WHEEL_TIME_CONSTANT_S
        actuator.set_to_velocity(gain)
        _limit_command(actuator, command, *((-limit.velocity, limit.velocity) if limit.velocity else ()))
        note = f"velocity actuator, gain {gain:.3g}"
    else:
        stiffness, damping = inertia * SERVO_BANDWIDTH**2, 2.0 * inertia * SERVO_BANDWIDTH
        actuator.set_to_position(stiffness, damping)
        known = limit.lower is not None and limit.upper is not None
        _limit_command(actuator, command, *((limit.lower, limit.upper) if known else ()))
        note = f"position actuator, stiffness {stiffness:.3g}, critically damped"
    element = f"servo of joint '{joint.name}'"
    return [Guess(element=element, note=f"{note}; it moves {inertia:.3g} (kg or kg m²)")]


def moved_inertia(description: RobotDescription, model: mujoco.MjModel) -> dict[str, float]:
    """Return the inertia [kg or kg m²] that each commanded joint and its followers move, base still."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    moved = {}
    for joint in description.commands:
        speed, momentum = np.zeros(model.nv), np.zeros(model.nv)
        for name, share in driven_joints(description, joint).items():
            speed[model.joint(name).dofadr[0]] = share
        mujoco.mj_mulM(model, data, momentum, speed)
        moved[joint] = float(speed @ momentum)
    return moved


def leader_of(description: RobotDescription, joint: str) -> tuple[str, float]:
    """Return the joint whose drive moves `joint`, and the velocity of `joint` per velocity of that one."""
    share, leader = 1.0, description.joints[joint]
    if leader.type not in ONE_DOF:
        return joint, 0.0
    while leader.mimic is not None:
        share *= leader.mimic.multiplier
        leader = description.joints[leader.mimic.joint]
    return (leader.name, share) if leader.type in ONE_DOF else (joint, 1.0)


def driven_joints(description: RobotDescription, joint: str) -> dict[str, float]:
    """Return `joint` and all joints that mimic it, each with its velocity per velocity of `joint`."""
    found = {name: leader_of(description, name) for name in description.joints}
    return {name: share for name, (leader, share) in found.items() if leader == joint and share}


def drive_ratio(description: RobotDescription, joint: str) -> float:
    """Return the effort of the drive of `joint` per effort of this joint, and of each that mimics it."""
    return sum(abs(share) for share in driven_joints(description, joint).values())


def _add(spec: mujoco.MjSpec, joint: Joint) -> mujoco.MjsActuator:
    return spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)


def _limit_force(actuator: mujoco.MjsActuator, effort: float | None) -> None:
    if effort is not None and effort > LEAST_RANGE:
        actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.forcerange = [-effort, effort]


def _limit_command(
    actuator: mujoco.MjsActuator,
    command: CommandSpec | None,
    low: float = -math.inf,
    high: float = math.inf,
) -> None:
    """Limit commands to what both the joint and its command interface allow."""
    if command is not None:
        low = low if command.lower is None else max(low, command.lower)
        high = high if command.upper is None else min(high, command.upper)
    if math.isinf(low) and math.isinf(high):
        return
    low, high = max(low, -LARGEST), min(high, LARGEST)
    if high - low > LEAST_RANGE:
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.ctrlrange = [low, high]


def _add_follower(spec: mujoco.MjSpec, joint: Joint, timestep: float, *, leader: str) -> None:
    """Let a joint follow `leader`, or stand at its offset if it has none that moves."""
    assert joint.mimic is not None
    equality = spec.add_equality(
        name=f"{joint.name}_mimic",
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=joint.name,
        name2=leader,
        solref=[max(0.004, 2.0 * timestep), 1.0],
        solimp=FOLLOWER_SOLIMP,
    )
    # a polynomial in the leader's position; the array's length differs between MuJoCo versions
    equality.data[:2] = joint.mimic.offset, joint.mimic.multiplier
