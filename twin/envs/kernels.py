"""The compiled loops over environments: drive controllers, encoders, odometry, lidar, observations.

Plain numbers one after the other, so that an environment gets the same bits alone and among many (numpy's
loops differ in the last one with the length and layout of arrays).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit

Ints = NDArray[np.int64]
Floats32 = NDArray[np.float32]


class DriveNumbers(NamedTuple):
    """What all drives share; `Axis` arrays are [largest velocity, acceleration, deceleration]."""

    linear: Array
    """[m/s, m/s², m/s²]"""
    angular: Array
    """[rad/s, rad/s², rad/s²]"""
    radius: float
    """Of the wheels as the controller believes [m]."""
    track: float
    """Effective wheel separation [m]."""
    fastest_wheel: float
    """By the controller's limit [rad/s]."""
    period: float
    """Of control [s]."""
    gain: float
    """Of the integral of the wheels' speed error [1/s]."""
    encoder_tick: float
    """[rad]"""
    is_left: NDArray[np.bool_]
    """Of each wheel, shape (w,)."""
    qpos: NDArray[np.intp]
    """Where the wheels' angles are, shape (w,)."""
    dof: NDArray[np.intp]
    """Where their speeds are, shape (w,)."""
    actuator: NDArray[np.intp]
    """Where their commands go, shape (w,)."""
    reach: Array
    """By so much a wheel's command may be ahead of its speed, shape (w,) [rad/s]."""
    fastest: Array
    """By the actuators' limit, shape (w,) [rad/s]."""


class DriveStates(NamedTuple):
    """Of n drives with w wheels each."""

    speed: Array
    """What the controller lets through at present [m/s, rad/s], shape (n, 2)."""
    on_the_way: Array
    """Wheel commands of the last ticks, newest at `tick` modulo the length, shape (n, delays, w) [rad/s]."""
    delay: Ints
    """Control periods from a wheel command to its start, shape (n,)."""
    tick: Ints
    """Control periods since the start of the episode, shape (n,)."""
    command: Array
    """The last that arrived, shape (n, w) [rad/s]."""
    owed: Array
    """Angle that the wheels owe, shape (n, w) [rad]."""
    angle: Array
    """Of the wheels at the last tick, shape (n, w) [rad]."""
    scale: Array
    """Counted over true angle, shape (n, w)."""
    counted: Array
    """By the encoders, mean of the left and of the right wheels, shape (n, 2) [rad]."""
    odometry: Array
    """x [m], y [m], yaw [rad] in `odom`, linear [m/s] and angular [rad/s] velocity, shape (n, 5)."""


@jit
def actuate(
    wanted: Array, drive: DriveNumbers, states: DriveStates, qpos: Array, qvel: Array, ctrl: Array
) -> None:
    """Do a control tick of n drives: velocity commands become wheel commands, and go to the actuators.

    As `DiffDriveController.update` and then `Hardware.apply` do for one.

    Args:
        wanted: Velocity commands [m/s, rad/s], shape (n, 2).
        drive: Of all.
        states: Theirs; changed.
        qpos: Positions of the simulations, shape (n, nq).
        qvel: Velocities, shape (n, nv).
        ctrl: Commands of their actuators, shape (n, nu); written for the wheels.
    """
    half = drive.track / 2.0
    for i in range(wanted.shape[0]):
        v = _limit(wanted[i, 0], states.speed[i, 0], drive.linear, drive.period)
        w = _limit(wanted[i, 1], states.speed[i, 1], drive.angular, drive.period)
        states.speed[i, 0], states.speed[i, 1] = v, w
        left, right = (v - w * half) / drive.radius, (v + w * half) / drive.radius
        quickest = max(abs(left), abs(right))
        if quickest > drive.fastest_wheel:
            left, right = (left * (drive.fastest_wheel / quickest), right * (drive.fastest_wheel / quickest))
        tick, delays = states.tick[i], states.on_the_way.shape[1]
        sent = tick - states.delay[i]
        for k in range(drive.qpos.shape[0]):
            states.on_the_way[i, tick % delays, k] = left if drive.is_left[k] else right
            command = states.on_the_way[i, sent % delays, k] if sent >= 0 else 0.0
            ctrl[i, drive.actuator[k]] = _servo(
                i, k, command, qpos[i, drive.qpos[k]], qvel[i, drive.dof[k]], drive, states
            )
        states.tick[i] = tick + 1


@jit
def _limit(target: float, value: float, axis: Array, period: float) -> float:
    """Return the velocity nearest to `target` that is reachable within a period, as `SpeedLimiter.limit`."""
    most = axis[0]
    target = min(max(target, -most), most)
    braking = abs(target) < abs(value) or target * value < 0.0
    step = (axis[2] if braking else axis[1]) * period
    return value + min(max(target - value, -step), step)


@jit
def _servo(
    i: int, k: int, command: float, angle: float, speed: float, drive: DriveNumbers, states: DriveStates
) -> float:
    """Return what the actuator of a wheel is told: the command and the integral of the speed error."""
    owed = states.owed[i, k] + states.command[i, k] * drive.period - (angle - states.angle[i, k])
    reach, fastest = drive.reach[k], drive.fastest[k]
    command = min(max(command, -fastest), fastest)
    low = max(speed - reach, -fastest) - command
    high = min(speed + reach, fastest) - command
    owed = min(max(owed, min(low, 0.0) / drive.gain), max(high, 0.0) / drive.gain)
    states.owed[i, k], states.command[i, k], states.angle[i, k] = owed, command, angle
    return command + drive.gain * owed


@jit
def dead_reckon(drive: DriveNumbers, states: DriveStates, qpos: Array) -> None:
    """Read the encoders of n drives and integrate their odometry, as `Odometry.update` does for one.

    Args:
        drive: Of all.
        states: Theirs; changed.
        qpos: Positions of the simulations, shape (n, nq).
    """
    wheels = drive.qpos.shape[0]
    for i in range(qpos.shape[0]):
        left, right, lefts = 0.0, 0.0, 0
        for k in range(wheels):
            angle = qpos[i, drive.qpos[k]] * states.scale[i, k]
            counted = round(angle / drive.encoder_tick) * drive.encoder_tick
            if drive.is_left[k]:
                left, lefts = left + counted, lefts + 1
            else:
                right += counted
        left, right = left / lefts, right / (wheels - lefts)
        step_left = (left - states.counted[i, 0]) * drive.radius
        step_right = (right - states.counted[i, 1]) * drive.radius
        states.counted[i, 0], states.counted[i, 1] = left, right
        distance, turned = (step_left + step_right) / 2.0, (step_right - step_left) / drive.track
        half = turned / 2.0
        chord = distance * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        heading = states.odometry[i, 2] + half
        states.odometry[i, 0] += chord * math.cos(heading)
        states.odometry[i, 1] += chord * math.sin(heading)
        states.odometry[i, 2] = _wrap(states.odometry[i, 2] + turned)
        states.odometry[i, 3], states.odometry[i, 4] = distance / drive.period, turned / drive.period


@jit
def _wrap(angle: float) -> float:
    """Return an angle [rad] within [-pi, pi]."""
    return angle - 2.0 * math.pi * round(angle / (2.0 * math.pi))


@jit
def aim(poses: Array, mount: Array, beams: Array, origins: Array, directions: Array) -> None:
    """Write where the rays of n lidars begin and point.

    Args:
        poses: Of the robots' roots, x y z and quat_wxyz, shape (n, 7).
        mount: Of the lidar in the root frame, shape (3,) [m].
        beams: Unit vectors in the root frame, shape (b, 3).
        origins: Written, in the world, shape (n, 1, 3) [m].
        directions: Written, in the world, shape (n, b, 3).
    """
    for i in range(poses.shape[0]):
        w, x, y, z = poses[i, 3], poses[i, 4], poses[i, 5], poses[i, 6]
        rows = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
        for j in range(3):
            a, b, c = rows[j]
            origins[i, 0, j] = poses[i, j] + a * mount[0] + b * mount[1] + c * mount[2]
            for k in range(beams.shape[0]):
                directions[i, k, j] = a * beams[k, 0] + b * beams[k, 1] + c * beams[k, 2]


@jit
def scan(hits: Array, noise: Array, stddev: Array, nearest: float, farthest: float, ranges: Array) -> None:
    """Write what n lidars measure, as `Lidar.sample` does for one; 0 for too near, the farthest for nothing.

    Args:
        hits: True distances, negative where nothing is hit, shape (n, b) [m].
        noise: Standard normal numbers, shape (n, b).
        stddev: Of the noise, shape (n,) [m].
        nearest: Of what is measured [m].
        farthest: Of what is measured [m].
        ranges: Written, shape (n, b) [m].
    """
    for i in range(hits.shape[0]):
        for k in range(hits.shape[1]):
            distance = hits[i, k]
            if distance < 0.0 or distance > farthest:
                ranges[i, k] = farthest
            elif distance < nearest:
                ranges[i, k] = 0.0
            else:
                ranges[i, k] = min(max(distance + stddev[i] * noise[i, k], 0.0), farthest)


@jit
def flatten(poses: Array, planar: Array) -> None:
    """Write x [m], y [m] and yaw [rad], shape (n, 3), of x y z and quat_wxyz, shape (n, 7)."""
    for i in range(poses.shape[0]):
        w, x, y, z = poses[i, 3], poses[i, 4], poses[i, 5], poses[i, 6]
        planar[i, 0], planar[i, 1] = poses[i, 0], poses[i, 1]
        planar[i, 2] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@jit
def compose(first: Array, then: Array, poses: Array) -> None:
    """Write planar poses `T_a_c` of `T_a_b` and `T_b_c`: x [m], y [m], yaw [rad], each of shape (n, 3)."""
    for i in range(first.shape[0]):
        c, s = math.cos(first[i, 2]), math.sin(first[i, 2])
        poses[i, 0] = first[i, 0] + c * then[i, 0] - s * then[i, 1]
        poses[i, 1] = first[i, 1] + s * then[i, 0] + c * then[i, 1]
        poses[i, 2] = first[i, 2] + then[i, 2]


@jit
def locate(poses: Array, points: Array, polar: Array) -> None:
    """Write where points are from poses: distance [m], cosine and sine of the bearing.

    Args:
        poses: x [m], y [m], yaw [rad], shape (n, 3).
        points: x [m], y [m] in the same frame, shape (n, k, 2).
        polar: Written, shape (n, 3 k).
    """
    for i in range(poses.shape[0]):
        for k in range(points.shape[1]):
            x, y = points[i, k, 0] - poses[i, 0], points[i, k, 1] - poses[i, 1]
            bearing = math.atan2(y, x) - poses[i, 2]
            polar[i, 3 * k] = math.sqrt(x * x + y * y)
            polar[i, 3 * k + 1], polar[i, 3 * k + 2] = math.cos(bearing), math.sin(bearing)
