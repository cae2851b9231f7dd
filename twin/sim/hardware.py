"""A robot's actuators and joint sensors: what ros2_control calls the hardware interface."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.convert.actuators import drive_ratio, leader_of
from twin.convert.contact_roles import commanded_wheels
from twin.errors import SimulationError, nearest
from twin.geometry import Array
from twin.models.description import RobotDescription
from twin.models.kinematics import ONE_DOF
from twin.savings import ALL, Savings
from twin.sim.factors import Factors
from twin.sim.indices import Indices, indices
from twin.sim.noise import NoiseStream
from twin.sim.servos import EffortServos, PositionServos


@dataclass(frozen=True, kw_only=True)
class HardwareConfig:
    """How well joints are measured."""

    encoder_ticks: int = 4096
    """Ticks per turn of the encoders of wheels and other continuous joints."""
    wheel_scale_stddev: float = 1e-3
    """Of the error by which a wheel's travel is misjudged, drawn once a run for each wheel: no tyre is of
    the size that odometry reckons with. It is why dead reckoning drifts even without slip."""
    wheel_integral_gain: float = 25.0
    """Of the wheels' motor controllers [1/s]."""
    position_noise_stddev: float = 1e-4
    """Of all other joints [rad] or [m]."""
    velocity_noise_stddev: float = 1e-3
    """Of all other joints [rad/s] or [m/s]."""


Orders = tuple[tuple[float, ...], tuple[tuple[str, float], ...]]
"""Commands of all actuators, and limits of effort by joint."""


class JointReading(NamedTuple):
    """Measured joints in the order of `Hardware.joint_names`, each of shape (n,) and read-only."""

    position: Array
    """[rad] or [m]"""
    velocity: Array
    """[rad/s] or [m/s]"""
    effort: Array
    """What the drives move each joint with; a drive moves those that mimic its joint as hard [Nm] or [N]."""


def _reading(position: Array, velocity: Array, effort: Array) -> JointReading:
    for values in (position, velocity, effort):
        values.setflags(write=False)  # who asks twice at one time is given the same
    return JointReading(position, velocity, effort)


class Hardware:
    """Reads joints as measured and hands commands to the actuators.

    An encoder counts whole ticks; its velocity is the difference of two counts, as on a real motor driver.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        robot: str,
        description: RobotDescription,
        seed: int,
        config: HardwareConfig | None = None,
        command_latency: float = 0.0,
        savings: Savings = ALL,
    ) -> None:
        """Bind the names of a robot to a compiled model; commands take `command_latency` [s]."""
        self.config = config or HardwareConfig()
        self._model, self._data = model, data
        # Views, made once: to ask MuJoCo for an array takes longer than to read a few numbers of it.
        self._all_qpos, self._all_qvel, self._all_ctrl = data.qpos, data.qvel, data.ctrl
        self._all_efforts = data.qfrc_actuator
        self._timestep = float(model.opt.timestep)
        self.joint_names = tuple(name for name, joint in description.joints.items() if joint.type in ONE_DOF)
        joints = [model.joint(f"{robot}/{name}") for name in self.joint_names]
        self._qpos = indices(joint.qposadr[0] for joint in joints)
        self._dof = indices(joint.dofadr[0] for joint in joints)
        kinds = [description.joints[name].type for name in self.joint_names]
        self._encoders = {
            i: int(joints[i].qposadr[0]) for i, kind in enumerate(kinds) if kind == "continuous"
        }
        """Joints with an encoder, and where each is in qpos."""
        self._tick = 2.0 * math.pi / self.config.encoder_ticks
        self._noise = NoiseStream(seed, f"{robot}/joints")
        scale = NoiseStream(seed, f"{robot}/wheels").normal(0, len(joints))
        wheels = {wheel.joint.name for wheel in commanded_wheels(description)}
        scale = 1.0 + self.config.wheel_scale_stddev * scale * [n in wheels for n in self.joint_names]
        self._own_scale: list[float] = scale.tolist()
        self._scale = self._own_scale.copy()
        self._misread: dict[int, Factors] = {}
        self._miscounted = [0.0] * len(joints)
        self._counts = {i: self._count(i) for i in self._encoders}
        self._step = 0
        self._drive_dof, self._drive_share = self._drives(model, robot, description)
        n = len(self.joint_names)
        self._noise_stddev = np.repeat(
            [self.config.position_noise_stddev, self.config.velocity_noise_stddev], n
        )
        at_start = np.rint(data.qpos[self._qpos] * scale / self._tick) * self._tick
        self._reading = _reading(at_start, np.zeros(n), np.zeros(n))

        prefix = f"{robot}/"
        self._actuators = np.array(
            [i for i in range(model.nu) if model.actuator(i).name.startswith(prefix)], dtype=np.intp
        )
        self._ctrl = indices(self._actuators)
        names = [model.actuator(i).name.removeprefix(prefix) for i in self._actuators]
        self._index = {name: i for i, name in enumerate(names)}
        self._commands: list[float] = data.ctrl[self._actuators].tolist()
        self._own_latency = round(command_latency / self._timestep)
        self._latency_steps = self._own_latency
        self._delays: dict[object, float] = {}
        """What faults add to the latency of commands [s]."""
        self._under_way: deque[tuple[int, list[float]]] = deque()
        self._last_arrived = self._commands.copy()
        self._wheels = _WheelServos(
            model, data, self._actuators, np.isin(names, list(wheels)), self.config.wheel_integral_gain
        )
        self._positions = PositionServos(model, data, self._actuators, savings)
        by_effort = [
            command
            for name, command in description.commands.items()
            if command.interface == "effort" and name not in wheels
        ]
        self._efforts = EffortServos(
            model,
            self._actuators,
            [self._index[command.joint] for command in by_effort],
            [(command.lower, command.upper) for command in by_effort],
        )
        limited = model.actuator_forcelimited[self._actuators].astype(bool)
        self._strongest = np.where(limited, model.actuator_forcerange[self._actuators, 1], math.inf)
        self._limits: dict[str, float] = {}
        """Of effort, by joint, as far as they were set."""
        self._strength: dict[int, Factors] = {}
        """Of drives that faults weaken, by index."""
        self._gears: dict[int, Factors] = {}
        """Wheels that are not of the size that the controllers reckon with, by index of their drives."""
        self.filters: list[Callable[[JointReading, int], JointReading | None]] = []
        """What faults make of a reading at a time [ns]; None: nothing new, the last one again."""
        self._ratios = [drive_ratio(description, name) for name in names]
        self.refused = 0
        """Commands ignored because they were not finite."""

    @property
    def commanded_joints(self) -> tuple[str, ...]:
        """Joints that `command` accepts."""
        return tuple(self._index)

    def read(self) -> JointReading:
        """Measure all joints; twice at one time gives the same reading."""
        step = round(self._data.time / self._timestep)
        if step == self._step:
            return self._reading
        tick, n = self._tick, len(self.joint_names)
        elapsed = (step - self._step) * self._timestep
        noise = self._noise_stddev * self._noise.normal(step, 2 * n)
        position, velocity = noise[:n], noise[n:]
        position += self._all_qpos[self._qpos]
        velocity += self._all_qvel[self._dof]
        for i in self._encoders:  # one by one: for a few wheels arrays cost several times as much
            count = self._count(i)
            position[i], velocity[i] = count * tick, (count - self._counts[i]) * (tick / elapsed)
            self._counts[i] = count
        effort = self._all_efforts[self._drive_dof] * self._drive_share
        reading: JointReading | None = _reading(position, velocity, effort)
        for passed in self.filters:
            if reading is not None:
                reading = passed(reading, round(self._data.time * 1e9))
        self._step, self._reading = step, self._reading if reading is None else reading
        return self._reading

    def command(self, joint: str, value: float) -> None:
        """Set what the joint's actuator is to do from the next `apply` on.

        Args:
            joint: One of `commanded_joints`.
            value: Position, velocity or effort, whichever the actuator takes (SI); one that is not finite is
                ignored and counted.

        Raises:
            SimulationError: No actuator moves this joint.
        """
        index = self._drive(joint)
        if math.isfinite(value):
            self._commands[index] = float(value)
        else:
            self.refused += 1

    def limit_effort(self, joint: str, effort: float) -> None:
        """Let the drive move a joint, and each that mimics it, with no more than `effort` from now on.

        Args:
            joint: One of `commanded_joints`.
            effort: [N] or [Nm]; the joint's own limit holds as well.

        Raises:
            SimulationError: No actuator moves this joint.
        """
        index = self._drive(joint)
        self._limits[joint] = effort
        self._limit(index, min(effort * self._ratios[index], self._strongest[index]))

    def weaken(self, joint: str, share: float | None, who: object) -> None:
        """Let the drive of a joint have a share of its largest effort left, as `who` says; None: as before.

        Args:
            joint: One of `commanded_joints`.
            share: Of the effort limit that it has otherwise, 0 to 1.
            who: Several may weaken one drive: the product of their shares holds.

        Raises:
            SimulationError: No actuator moves this joint.
        """
        index = self._drive(joint)
        self._strength.setdefault(index, Factors()).put(who, share)
        own = self._limits.get(joint, math.inf) * self._ratios[index]
        self._limit(index, min(own, self._strongest[index]))

    def strongest(self, joint: str) -> float:
        """Return what the drive of a joint can do at most [N] or [Nm] at the actuator; inf: no limit."""
        return _torque_limit(self._model, self._actuators[self._drive(joint)])

    def exerted(self, joint: str) -> float:
        """Return what the drive of a joint did in the last physics step [N] or [Nm] at the actuator."""
        return float(self._data.actuator_force[self._actuators[self._drive(joint)]])

    def _limit(self, index: int, own: float) -> None:
        """Bound what a drive does; `own` is its bound without faults."""
        actuator, share = self._actuators[index], self._strength.get(index, Factors()).product
        if share != 1.0:
            own = min(own, _joint_limit(self._model, actuator))
        strongest = own * share if share else 0.0
        self._model.actuator_forcelimited[actuator] = math.isfinite(strongest)
        self._model.actuator_forcerange[actuator] = -strongest, strongest
        self._wheels.limit(index, strongest)
        self._efforts.limit(index, strongest)

    @property
    def orders(self) -> Orders:
        """What was commanded, for the `obey` of the same robot in another process."""
        return tuple(self._commands), tuple(self._limits.items())

    def obey(self, orders: Orders) -> None:
        """Take what was commanded in another process."""
        commands, limits = orders
        self._commands[:] = commands
        for joint, effort in limits:
            if self._limits.get(joint) != effort:
                self.limit_effort(joint, effort)

    def apply(self) -> None:
        """Hand the commands to the physics; called once a tick, before the step."""
        commands = [*(self._arrived() if self._latency_steps else self._commands)]
        for index, gear in self._gears.items():
            commands[index] *= gear.product
        now = self._data.time
        self._wheels.apply(commands, now)
        self._positions.apply(commands, now)
        self._efforts.apply(commands)
        self._all_ctrl[self._ctrl] = commands

    def miscount(self, joint: str, angle: float) -> None:
        """Let the encoder of a joint jump, as one does that lost its power or picked up a disturbance.

        Args:
            joint: One of `joint_names` that has an encoder.
            angle: By which it is wrong from now on [rad].

        Raises:
            SimulationError: No encoder measures this joint.
        """
        self._miscounted[self._index_of_encoder(joint)] += round(angle / self._tick)

    def misread(self, joint: str, factor: float | None, who: object = None) -> None:
        """Let the encoder of a joint count `factor` times what it should: -1 the wrong way, 0 nothing.

        Args:
            joint: One of `joint_names` that has an encoder.
            factor: Of what it counts from now on; None: as before.
            who: Several may have their factors: their product holds.

        Raises:
            SimulationError: No encoder measures this joint.
        """
        index = self._index_of_encoder(joint)
        before = self._count(index)
        factors = self._misread.setdefault(index, Factors())
        factors.put(who, factor)
        self._scale[index] = factors.product * self._own_scale[index]
        self._miscounted[index] += before - self._count(index)

    def resize_wheel(self, joint: str, factor: float | None, who: object) -> None:
        """Let a wheel be `factor` times as large as all reckon with, but for the height of the robot.

        For a turn that the motor makes and the encoder counts, the robot comes `factor` times as far.

        Args:
            joint: A driven wheel's, with an encoder.
            factor: More than 0; None: as before.
            who: Several may have their factors: their product holds.

        Raises:
            SimulationError: No actuator or no encoder is at this joint.
        """
        index = self._drive(joint)
        self.misread(joint, None if factor is None else 1.0 / factor, ("resized", who))
        gear = self._gears.setdefault(index, Factors())
        gear.put(who, factor)
        if not gear:
            del self._gears[index]

    def delay_commands(self, seconds: float | None, who: object) -> None:
        """Let commands take so much longer [s] from now on, as `who` says; None: no longer than before."""
        self._delays.pop(who, None)
        if seconds is not None:
            self._delays[who] = seconds
        if not self._latency_steps:
            self._under_way.clear()
            self._last_arrived = self._commands.copy()
        self._latency_steps = self._own_latency + round(sum(self._delays.values()) / self._timestep)

    @property
    def is_late(self) -> bool:
        """Whether commands are under way that change something when they arrive."""
        return any(commands != self._last_arrived for _, commands in self._under_way)

    def angle(self, joint: str) -> float:
        """Return where a joint truly is [rad] or [m]."""
        return float(self._all_qpos[self._qpos][self.joint_names.index(joint)])

    def ordered(self, joint: str) -> float:
        """Return the last command for a joint."""
        return self._commands[self._drive(joint)]

    @property
    def encoders(self) -> tuple[str, ...]:
        """Joints that an encoder measures."""
        return tuple(self.joint_names[i] for i in self._encoders)

    def _index_of_encoder(self, joint: str) -> int:
        if joint not in self.encoders:
            raise SimulationError(f"no encoder measures joint '{joint}'; {nearest(joint, self.encoders)}")
        return self.joint_names.index(joint)

    def _drive(self, joint: str) -> int:
        index = self._index.get(joint)
        if index is None:
            raise SimulationError(f"no actuator for joint '{joint}'; {nearest(joint, self._index)}")
        return index

    def _drives(
        self, model: mujoco.MjModel, robot: str, description: RobotDescription
    ) -> tuple[Indices, Array]:
        """Return for each joint the velocity address of the joint whose drive moves it, and its share."""
        found = [leader_of(description, name) for name in self.joint_names]
        dofs = [model.joint(f"{robot}/{leader}").dofadr[0] for leader, _ in found]
        shares = [np.sign(share) / drive_ratio(description, leader) for leader, share in found]
        return indices(dofs), np.array(shares)

    def _arrived(self) -> list[float]:
        """Send the present commands on their way; return the newest ones that have arrived."""
        now = round(self._data.time / self._timestep)
        self._under_way.append((now + self._latency_steps, self._commands.copy()))
        while self._under_way and self._under_way[0][0] <= now:
            self._last_arrived = self._under_way.popleft()[1]
        return self._last_arrived

    def reset(self) -> None:
        """Forget the past; to be called when the state of the physics was set from outside."""
        self._wheels.reset()

    def _count(self, joint: int) -> float:
        angle = self._all_qpos.item(self._encoders[joint])
        return round(angle * self._scale[joint] / self._tick) + self._miscounted[joint]


class _WheelServos:
    """Integral action of the wheels' motor controllers, on top of the model's velocity servos.

    A velocity servo alone yields to a steady load: on a slope it creeps downhill, in a curve the outer wheel
    slows down. Motor controllers add the integral of the speed error, which is the angle that the wheel owes;
    at a command of zero it holds the wheel. It is limited to what the motor's torque can make good at once
    (no wind-up): a wheel held up by a wall does not make up for the angle later.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        actuators: NDArray[np.intp],
        turning: NDArray[np.bool_],
        gain: float,
    ) -> None:
        """Bind to those of a robot's actuators that turn wheels; `gain` of the integral [1/s]."""
        self._model, self._data, self._gain = model, data, gain
        self._all_qpos, self._all_qvel = data.qpos, data.qvel
        self._which: list[int] = np.flatnonzero(turning).tolist()
        self._drives = actuators = actuators[turning]
        joints = model.actuator_trnid[actuators, 0]
        self._qpos, self._dof = indices(model.jnt_qposadr[joints]), indices(model.jnt_dofadr[joints])
        self._damping: list[float] = (-model.actuator_biasprm[actuators, 2]).tolist()
        self._reach, self._fastest = servo_bounds(model, actuators)
        self.reset()

    def reset(self) -> None:
        """Owe nothing; to be called when the state was set from outside."""
        self._command = [0.0] * len(self._which)
        self._owed = [0.0] * len(self._which)
        self._position: list[float] = self._all_qpos[self._qpos].tolist()
        self._time = float(self._data.time)

    def limit(self, actuator: int, torque: float) -> None:
        """Take another bound of what a drive does [Nm], if it turns a wheel; `actuator` of the robot's."""
        if actuator in self._which:
            i = self._which.index(actuator)
            limit = min(torque, _joint_limit(self._model, self._drives[i]))
            self._reach[i] = limit / self._damping[i]

    def apply(self, commands: list[float], now: float) -> None:
        """Add the integral to the commands of the wheels; `now` is the simulated time [s]."""
        elapsed = now - self._time
        position, speed = self._all_qpos[self._qpos].tolist(), self._all_qvel[self._dof].tolist()
        gain, last, owing, before = self._gain, self._command, self._owed, self._position
        # Numbers one by one: for a few wheels arrays cost five times as much, and min and max as much again.
        for i, actuator in enumerate(self._which):
            reach, fastest, command = self._reach[i], self._fastest[i], commands[actuator]
            owed = owing[i] + last[i] * elapsed - (position[i] - before[i])
            command = -fastest if command < -fastest else fastest if command > fastest else command
            low, high = speed[i] - reach, speed[i] + reach
            low = (-fastest if low < -fastest else low) - command
            high = (fastest if high > fastest else high) - command
            # Where the command alone is out of reach, nothing is owed.
            least, most = (low / gain if low < 0.0 else 0.0), (high / gain if high > 0.0 else 0.0)
            owing[i] = owed = least if owed < least else most if owed > most else owed
            last[i] = command
            commands[actuator] = command + gain * owed
        self._position, self._time = position, now


def servo_bounds(model: mujoco.MjModel, actuators: NDArray[np.intp]) -> tuple[list[float], list[float]]:
    """Return of each velocity servo how far its command may be ahead of its joint's speed, and the fastest.

    Farther ahead its torque would not rise any more; both are in [rad/s].
    """
    torques = [_torque_limit(model, i) for i in actuators]
    damping = (-model.actuator_biasprm[actuators, 2]).tolist()
    reach = [torque / slope for torque, slope in zip(torques, damping, strict=True)]
    limited = model.actuator_ctrllimited[actuators].tolist()
    ranges = model.actuator_ctrlrange[actuators, 1].tolist()
    return reach, [top if known else math.inf for known, top in zip(limited, ranges, strict=True)]


def _torque_limit(model: mujoco.MjModel, actuator: int) -> float:
    own = model.actuator_forcerange[actuator, 1] if model.actuator_forcelimited[actuator] else math.inf
    return min(float(own), _joint_limit(model, actuator))


def _joint_limit(model: mujoco.MjModel, actuator: int) -> float:
    joint = model.actuator_trnid[actuator, 0]
    return float(model.jnt_actfrcrange[joint, 1]) if model.jnt_actfrclimited[joint] else math.inf
