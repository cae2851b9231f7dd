"""Many simulations of one driven robot: commands in, odometry, scans and collisions out."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator

import mujoco
import mujoco.batch
import numpy as np
from numpy.typing import NDArray

from twin.controllers.diff_drive import DiffDriveConfig
from twin.envs import kernels
from twin.envs.kernels import DriveNumbers, DriveStates
from twin.envs.randomisation import Episode, Randomisation, RobotDraw
from twin.envs.robot import ROBOT, DrivenRobot
from twin.errors import GymError, SimulationError
from twin.geometry import Array, Pose2, quat_wxyz_from_yaw
from twin.sim.hardware import HardwareConfig, servo_bounds
from twin.sim.scene import Scene

Rows = slice | NDArray[np.intp]
"""Which of the simulations."""
ALL = slice(None)


class Simulations:
    """Copies of a scene with a robot in it, each with a robot of its own draw; all take a step at once.

    The same calls give the same bits for any number of threads, and in any company.
    """

    def __init__(
        self,
        robot: DrivenRobot,
        scene: Scene,
        count: int,
        *,
        control_period: float,
        beams: int,
        randomisation: Randomisation,
        threads: int,
    ) -> None:
        """Compile one model, and make `count` simulations of it.

        Args:
            robot: Which.
            scene: Around it.
            count: n.
            control_period: Of wheel commands and odometry [s].
            beams: How many of the lidar's rays are cast.
            randomisation: How far robots may differ.
            threads: That share the work; 0: one for each CPU.

        Raises:
            GymError: No simulation, or less than no thread.
        """
        if count < 1 or threads < 0:
            wrong = f"num_envs is {count}; valid: 1" if count < 1 else f"threads is {threads}; valid: 0"
            raise GymError(f"{wrong} or more")
        self.robot, self.count, self.randomisation = robot, count, randomisation
        self.model = robot.compile(scene)
        self._own = _Randomiser(robot, self.model)
        self.batch = mujoco.batch.Batch(self.model, count, threads)
        self._fields = {name: self.batch.expand(name) for name in self._own.fields}
        bind = self.batch.bind
        self.qpos, self.qvel, self.ctrl = bind("qpos"), bind("qvel"), bind("ctrl")
        self.mocap_pos, self.mocap_quat = bind("mocap_pos"), bind("mocap_quat")
        self._touches = bind("sensordata")
        root = self.model.jnt_qposadr[self.model.body(f"{ROBOT}/{robot.description.root}").jntadr[0]]
        self.root = self.qpos[:, root : root + 7]
        """Poses of the root link, x y z [m] and quat_wxyz, shape (n, 7)."""
        self._substeps = round(control_period / self.model.opt.timestep)
        self.drive = _drive_numbers(robot, self.model, control_period)
        self.states = _drive_states(count, robot, self.drive, randomisation)
        self.lidar_noise = np.zeros(count)
        """Standard deviation of each lidar's ranges, shape (n,) [m]."""
        self._mount, self._beams = robot.T_root_lidar.xyz, robot.beams(beams)
        self._lidar_body = int(self.model.body(f"{ROBOT}/{robot.lidar.link}").id)
        """The lidar does not see it."""

    def begin(self, i: int, episode: Episode, start: Pose2) -> None:
        """Let simulation `i` begin an episode: a robot of its own draw, at rest at `start`."""
        draw = episode.robot(self.randomisation)
        for name, values in self._own.draw(draw):
            self._fields[name][i] = values
        self.batch.reset(ids=[i], stage=mujoco.mjtStage.mjSTAGE_NONE)
        self.root[i] = (start.x, start.y, self.robot.spawn_height, *quat_wxyz_from_yaw(start.yaw))
        for state in self.states:
            state[i] = 0
        states, wheels = self.states, len(self.drive.qpos)
        states.delay[i] = math.ceil(round(draw.latency / self.drive.period, 6))
        states.scale[i] = 1.0 + HardwareConfig.wheel_scale_stddev * episode.constants(wheels)
        self.lidar_noise[i] = draw.lidar_noise

    def tick(self, wanted: Array) -> NDArray[np.bool_]:
        """Advance all by a control period.

        Args:
            wanted: Velocity commands to the robots' controllers [m/s, rad/s], shape (n, 2).

        Returns:
            Which robots touch anything but the floor at the end, shape (n,).

        Raises:
            SimulationError: MuJoCo cannot go on with one.
        """
        kernels.actuate(wanted, self.drive, self.states, self.qpos, self.qvel, self.ctrl)
        try:
            self.batch.step(nstep=self._substeps)
        except mujoco.batch.SimulationError as fault:
            raise SimulationError(f"the physics of environment {fault.ids[0]} gave up: {fault}") from fault
        kernels.dead_reckon(self.drive, self.states, self.qpos)
        anything, floor, itself = self._touches.T
        return np.asarray(anything > floor + itself)

    def check(self) -> None:
        """Raise SimulationError if the physics of one diverged."""
        finite = np.isfinite(self.qvel).all(axis=1)
        if not finite.all():
            which = int(np.argmin(finite))
            raise SimulationError(f"the physics of environment {which} diverged; reset it")

    def rays(self, rows: Rows = ALL) -> tuple[Array, Array]:
        """Return where the rays of some lidars begin [m], shape (n, 1, 3), and point, shape (n, beams, 3)."""
        poses = self.root[rows]
        origins, directions = np.empty((len(poses), 1, 3)), np.empty((len(poses), *self._beams.shape))
        kernels.aim(poses, self._mount, self._beams, origins, directions)
        return origins, directions

    def hits(self, rows: Rows = ALL) -> Array:
        """Cast the rays of some lidars at present; return distances, -1 for no hit, shape (n, beams) [m]."""
        origins, directions = self.rays(rows)
        ids = None if isinstance(rows, slice) else rows
        distances, _ = self.batch.ray(
            origins, directions, geomgroup=self.robot.seen, bodyexclude=self._lidar_body, ids=ids
        )
        return np.asarray(distances)

    def scan(self, hits: Array, noise: Array, rows: Rows = ALL) -> Array:
        """Return what lidars measure, shape (n, beams) [m]; `noise` is standard normal."""
        lidar, ranges = self.robot.lidar, np.empty_like(hits)
        kernels.scan(hits, noise, self.lidar_noise[rows], lidar.range_min, lidar.range_max, ranges)
        return ranges


class _Randomiser:
    """Works out the model of a drawn robot, on a copy of the model of its own."""

    def __init__(self, robot: DrivenRobot, model: mujoco.MjModel) -> None:
        wheels = robot.wheels(model)
        names = [model.body(i).name for i in range(model.nbody)]
        self._bodies = np.array([i for i, name in enumerate(names) if name.startswith(f"{ROBOT}/")])
        self._wheels, self._is_left = wheels.body, wheels.is_left
        bodies = model.geom_bodyid
        self._tyres = np.flatnonzero(np.isin(bodies, wheels.body) & (model.geom_contype > 0))
        self._tyre_is_left = np.isin(bodies[self._tyres], wheels.body[wheels.is_left])
        self._up = _up_in_parents(model, wheels.body)
        # Sizes that are the radius: of an ellipsoid, as a tyre is made of, two; otherwise the first.
        sizes = model.geom_size[self._tyres]
        ellipsoid = model.geom_type[self._tyres] == mujoco.mjtGeom.mjGEOM_ELLIPSOID
        largest = np.isclose(sizes, sizes.max(axis=1, keepdims=True))
        self._round = np.where(ellipsoid[:, None], largest, [True, False, False])
        self._model, self._data = copy.copy(model), mujoco.MjData(model)
        nominal = ("body_mass", "body_inertia", "body_pos", "geom_friction", "geom_size")
        self._nominal = {name: getattr(model, name).copy() for name in nominal}
        self._work_out(RobotDraw(1.01, 1.01, 1.01, 0.99, 0.0, 0.0))  # to see what follows from these
        others = sorted(mujoco.batch.MODEL_FIELDS - set(nominal))
        physical = [name for name in others if not name.startswith(("opt.", "light_", "cam_"))]
        self.fields = (*nominal, *(name for name in physical if self._differs(name, model)))
        """Of the model, which are different for each robot."""

    def draw(self, draw: RobotDraw) -> Iterator[tuple[str, Array]]:
        """Yield the values of `fields` for a robot, valid until the next draw."""
        self._work_out(draw)
        for name in self.fields:
            yield name, getattr(self._model, name)

    def _work_out(self, draw: RobotDraw) -> None:
        model, nominal = self._model, self._nominal
        for name in ("body_mass", "body_inertia"):
            getattr(model, name)[self._bodies] = nominal[name][self._bodies] * draw.mass
        tyres = self._tyres
        model.geom_friction[tyres, 0] = nominal["geom_friction"][tyres, 0] * draw.friction
        factors = np.where(self._tyre_is_left, draw.radius_left, draw.radius_right)
        grown = np.where(self._round, factors[:, None], 1.0)
        model.geom_size[tyres] = nominal["geom_size"][tyres] * grown
        # Axles move up with the radius, or the robot would lose its casters or its wheels the ground.
        factors = np.where(self._is_left, draw.radius_left, draw.radius_right)
        rise = self._radii() * (factors - 1.0)
        model.body_pos[self._wheels] = nominal["body_pos"][self._wheels] + rise[:, None] * self._up
        mujoco.mj_setConst(model, self._data)

    def _radii(self) -> Array:
        sizes, bodies = self._nominal["geom_size"][self._tyres, 0], self._model.geom_bodyid[self._tyres]
        return np.array([sizes[bodies == wheel].max() for wheel in self._wheels])

    def _differs(self, name: str, model: mujoco.MjModel) -> bool:
        return not np.array_equal(getattr(self._model, name), getattr(model, name))


def _up_in_parents(model: mujoco.MjModel, bodies: NDArray[np.intp]) -> Array:
    """Return the world's z axis in the frames of the bodies' parents, shape (n, 3)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return np.array([data.xmat[model.body_parentid[body]].reshape(3, 3)[2] for body in bodies])


def _drive_numbers(robot: DrivenRobot, model: mujoco.MjModel, period: float) -> DriveNumbers:
    config: DiffDriveConfig = robot.drive
    hardware, wheels = HardwareConfig(), robot.wheels(model)
    reach, fastest = servo_bounds(model, wheels.actuator)
    linear, angular = (
        np.array([axis.max_velocity, axis.max_acceleration, axis.braking])
        for axis in (config.linear, config.angular)
    )
    return DriveNumbers(
        linear=linear,
        angular=angular,
        radius=config.wheel_radius,
        track=config.wheel_separation * config.wheel_separation_multiplier,
        fastest_wheel=config.max_wheel_velocity,
        period=period,
        gain=hardware.wheel_integral_gain,
        encoder_tick=2.0 * math.pi / hardware.encoder_ticks,
        is_left=wheels.is_left,
        qpos=wheels.qpos,
        dof=wheels.dof,
        actuator=wheels.actuator,
        reach=np.array(reach),
        fastest=np.array(fastest),
    )


def _drive_states(n: int, robot: DrivenRobot, drive: DriveNumbers, spread: Randomisation) -> DriveStates:
    w = len(drive.qpos)
    delays = math.ceil(round(spread.latency[1] / drive.period, 6)) + 1
    return DriveStates(
        speed=np.zeros((n, 2)),
        on_the_way=np.zeros((n, delays, w)),
        delay=np.zeros(n, np.int64),
        tick=np.zeros(n, np.int64),
        command=np.zeros((n, w)),
        owed=np.zeros((n, w)),
        angle=np.zeros((n, w)),
        scale=np.ones((n, w)),
        counted=np.zeros((n, 2)),
        odometry=np.zeros((n, 5)),
    )
