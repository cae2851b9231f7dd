"""Driving to goals past obstacles: what observations, actions and rewards are, for n environments at once."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.envs import kernels
from twin.envs.agent import DrivingAgent
from twin.envs.kernels import Floats32
from twin.envs.pictures import BLUE, Camera, Mark, Placed
from twin.envs.randomisation import Episode, Randomisation
from twin.envs.robot import DrivenRobot
from twin.envs.simulations import ALL, Rows, Simulations
from twin.errors import GymError, nearest
from twin.geometry import Array, Pose2, Pose3, quat_wxyz_from_yaw
from twin.models.shapes import Box
from twin.sim.scene import PlacedBody, Scene, Shape
from twin.warehouse.arena_scene import PALETTE

if TYPE_CHECKING:
    from twin.envs.live import LiveWindow

_HIDDEN_M = -20.0
"""Height of what is not there in an episode: no ray and no robot comes so low."""
_NEAR_M = 8.0
"""Distance of a camera that follows a robot."""
_POINT_M = 0.1
"""Radius of the disc where a point to drive to is."""
_OPTIONS = ("start", "goal")


@dataclass(frozen=True, kw_only=True)
class Reward:
    """What a step is worth."""

    progress: float = 1.0
    """For each metre nearer to the goal."""
    step: float = -0.01
    """For each step: the sooner the better."""
    goal: float = 5.0
    """Once, when the goal is reached."""
    collision: float = -5.0
    """Once, when the robot touches anything but the floor."""


@dataclass(frozen=True, kw_only=True)
class NavigationConfig:
    """An environment in which a robot drives to goals."""

    robot: str
    """Name of a robot of the catalogue, or its file; it needs a drive and a lidar."""
    timestep: float = 0.004
    """Of the physics [s]."""
    control_period: float = 0.02
    """Of wheel commands and odometry, as scenarios have it by default [s]."""
    decision_period: float = 0.1
    """Of a step: the lidar's [s]."""
    beams: int = 36
    """Of the lidar: every so-manieth ray, from the first one on."""
    goal_tolerance: float = 0.3
    """The goal is reached when the root link's origin is so near [m]."""
    goal_range: float = 15.0
    """Goals farther away are observed as so far [m]."""
    reward: Reward = field(default_factory=Reward)
    """What a step is worth."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    """How far the robot differs from episode to episode."""

    def __post_init__(self) -> None:
        for name, inner in (("control_period", "timestep"), ("decision_period", "control_period")):
            long, short = getattr(self, name), getattr(self, inner)
            if not 0.0 < short <= long or abs(long / short - round(long / short)) > 1e-6:
                raise GymError(
                    f"{name} is {long:g} s, no whole number of times {inner}, which is {short:g} s"
                )


class Layout(NamedTuple):
    """Where things are when an episode begins, in the world frame."""

    start: Pose2
    """Of the robot's root link."""
    goal: tuple[float, float]
    """x, y [m]"""
    placed: Sequence[Pose2 | None]
    """Of each placed body of the scene; None: it is not there."""


class Course(ABC):
    """Where robots drive: the scene, and where start, goal and obstacles are in an episode."""

    scene: Scene
    """As it is simulated."""
    looks: Scene
    """As it is drawn: perhaps with more that never moves."""
    overview: float | None
    """From where a picture shows everything around the origin [m]; None: pictures follow the robot."""

    @abstractmethod
    def layout(self, episode: Episode) -> Layout:
        """Return where things are in an episode; the same for equal episodes."""


class Outcome(NamedTuple):
    """Of a step of n environments; each has shape (n,)."""

    reward: Array
    success: NDArray[np.bool_]
    collision: NDArray[np.bool_]
    distance: Array
    """True, to the goal [m]."""

    def clear(self, i: int, distance: float) -> None:
        """Let nothing have happened in environment `i`, which is so far from its goal [m]."""
        self.reward[i], self.success[i], self.collision[i], self.distance[i] = 0.0, False, False, distance


class Navigation:
    """n environments on one course, without any convention of gymnasium's on top."""

    POINTS: ClassVar[int] = 1
    """That robots drive to."""
    NOISES: ClassVar[int] = 0
    """Normal numbers of a step beside those of the lidar."""

    def __init__(self, config: NavigationConfig, course: Course, robot: DrivenRobot, n: int, threads: int):
        self.config, self.course, self.count = config, course, n
        self.simulations = Simulations(
            robot,
            course.scene,
            n,
            control_period=config.control_period,
            beams=config.beams,
            randomisation=config.randomisation,
            threads=threads,
        )
        self._ticks = round(config.decision_period / config.control_period)
        self.agent = DrivingAgent(
            robot.drive, robot.lidar, beams=config.beams, points=self.POINTS, farthest=config.goal_range
        )
        self._episodes = [Episode(0, 0)] * n
        self.steps = np.zeros(n, np.int64)
        """Steps since the start of each episode."""
        self.layouts: list[Layout | None] = [None] * n
        """Of the present episodes."""
        self._goals, self._starts = np.zeros((n, 2)), np.zeros((n, 3))
        self._actions, self._way = np.zeros((n, 2)), np.zeros(n)
        self._noise = np.zeros((n, config.beams + self.NOISES))

    def begin(self, i: int, episode: Episode, options: Mapping[str, Any] | None = None) -> None:
        """Let environment `i` begin an episode; `options` may say where `start` and `goal` are."""
        layout = self._laid_out(i, episode, options)
        simulations = self.simulations
        self._episodes[i], self.layouts[i] = episode, layout
        self.steps[i], self._goals[i], self._starts[i] = 0, layout.goal, layout.start
        self._actions[i] = 0.0
        simulations.begin(i, episode, layout.start)
        for k, (body, pose) in enumerate(zip(self.course.scene.placed, layout.placed, strict=True)):
            height = float(body.T_world_body.xyz[2])
            x, y, yaw = pose or (0.0, 0.0, 0.0)
            simulations.mocap_pos[i, k] = (x, y, height if pose else _HIDDEN_M)
            simulations.mocap_quat[i, k] = quat_wxyz_from_yaw(yaw)
        self._way[i] = self._to_go(np.array([i]))[0]

    def _laid_out(self, i: int, episode: Episode, options: Mapping[str, Any] | None) -> Layout:
        """Return where everything is as environment `i` begins an episode."""
        return _with_options(self.course.layout(episode), options)

    def act(self, actions: Array) -> Outcome:
        """Take a step with actions of the action space, shape (n, 2).

        Raises:
            SimulationError: The physics of one diverged.
        """
        simulations, reward = self.simulations, self.config.reward
        self._actions = np.clip(actions, -1.0, 1.0)
        wanted = self.agent.velocities(self._actions)
        collision = np.zeros(self.count, np.bool_)
        for _ in range(self._ticks):
            self._before_tick()
            collision |= simulations.tick(wanted)
        simulations.check()
        self.steps += 1
        distance, way = self.distances(), self._to_go(ALL)
        success = (distance <= self.config.goal_tolerance) & ~collision
        value = reward.progress * (self._way - way) + reward.step
        value += reward.goal * success + reward.collision * collision
        self._way = way
        return Outcome(value, success, collision, distance)

    def _before_tick(self) -> None:
        """Move what moves by itself."""

    def _to_go(self, rows: Rows) -> Array:
        """Return how far some robots truly have to go, shape (n,) [m]; here: as the crow flies."""
        return self.distances()[rows]

    def distances(self) -> Array:
        """Return how far the robots truly are from their goals, shape (n,) [m]."""
        x, y = (self.simulations.root[:, :2] - self._goals).T
        return np.asarray(np.sqrt(x * x + y * y))

    def observe(self, rows: Rows = ALL) -> Floats32:
        """Return the observations of some environments, shape (n, m)."""
        simulations = self.simulations
        which = range(self.count) if isinstance(rows, slice) else rows
        noise = self._noise[: len(which)]
        for row, i in zip(noise, which, strict=True):
            row[:] = self._episodes[i].normal(int(self.steps[i]), len(row))
        beams = self.config.beams
        ranges = simulations.scan(simulations.hits(rows), noise[:, :beams], rows)
        poses = self._believed(rows, noise[:, beams:])
        points = self._points(rows, poses)
        speeds = simulations.states.odometry[rows, 3:]
        return self.agent.observe(poses, points, speeds, self._actions[rows], ranges)

    def _believed(self, rows: Rows, noise: Array) -> Array:
        """Return where robots believe that they are in the world, shape (n, 3); here: by dead reckoning."""
        starts = self._starts[rows]
        poses = np.empty_like(starts)
        kernels.compose(starts, self.simulations.states.odometry[rows], poses)
        return poses

    def picture(self, i: int) -> NDArray[np.uint8]:
        """Return a picture of environment `i`: goal in green, other points to drive to in blue.

        Raises:
            SimulationError: This computer can draw nothing.
        """
        row, simulations = np.array([i]), self.simulations
        points = self._points(row, self._believed(row, np.zeros((1, self.NOISES))))[0].tolist()
        marks = [Mark(points[0][0], points[0][1], self.config.goal_tolerance)]
        marks += [Mark(x, y, _POINT_M, BLUE) for x, y in points[1:]]
        placed = Placed(simulations.qpos[i], simulations.mocap_pos[i], simulations.mocap_quat[i])
        overview = self.course.overview
        at = (0.0, 0.0, 0.0) if overview else simulations.root[i, :3] * (1.0, 1.0, 0.0)
        return self._camera.take(placed, at, distance=overview or _NEAR_M, marks=marks)

    def begin_showing(self) -> None:
        """Show that the first environment begins an episode in Rerun's viewer, which starts if need be.

        Raises:
            RecordingError: There is no viewer, or it does not start.
        """
        episode, layout = self._episodes[0], self.layouts[0]
        assert layout is not None, "an episode has begun"
        name = f"seed {episode.seed}, episode {episode.number}"
        self._window.begin(name, layout.goal, self.config.goal_tolerance)
        self.show()

    def show(self) -> None:
        """Show the first environment's present state."""
        simulations, first = self.simulations, np.array([0])
        (origins,), (directions,) = simulations.rays(first)
        (hits,) = simulations.hits(first)
        seen = (hits > 0.0) & (hits < simulations.robot.lidar.range_max)
        elapsed = int(self.steps[0]) * round(self.config.decision_period * 1e9)
        self._window.show(elapsed, (origins + hits[:, None] * directions)[seen])

    @cached_property
    def _window(self) -> LiveWindow:
        from twin.envs.live import LiveWindow  # imports rerun, which takes 0.4 s

        return LiveWindow(self.simulations, self.course.looks)

    @cached_property
    def _camera(self) -> Camera:
        model = self.simulations.robot.compile(self.course.looks, visuals=True)
        return Camera(model, azimuth=90.0)

    def close(self) -> None:
        """Free what drawing took, and end the viewer."""
        for name in ("_camera", "_window"):
            if name in self.__dict__:
                self.__dict__.pop(name).close()

    def _points(self, rows: Rows, poses: Array) -> Array:
        """Return the points that robots drive to, shape (n, POINTS, 2) [m]; here: their goals."""
        return self._goals[rows, None]


def _with_options(layout: Layout, options: Mapping[str, Any] | None) -> Layout:
    """Return a layout with start and goal as `reset`'s options say.

    Raises:
        GymError: An option is unknown, or no list of finite numbers.
    """
    if not options:
        return layout
    for name in options:
        if name not in _OPTIONS:
            raise GymError(f"unknown option '{name}' of reset; {nearest(name, _OPTIONS)}")
    start, goal = options.get("start", layout.start), options.get("goal", layout.goal)
    for name, value, length in (("start", start, 3), ("goal", goal, 2)):
        numbers = np.asarray(value, dtype=object).ravel()
        if len(numbers) != length or not all(
            isinstance(number, int | float | np.number) and math.isfinite(number) for number in numbers
        ):
            words = "x [m], y [m], yaw [rad]" if length == 3 else "x [m], y [m]"
            raise GymError(f"option '{name}' of reset is {value!r}; valid: {words}")
    return layout._replace(start=Pose2(*map(float, start)), goal=(float(goal[0]), float(goal[1])))


def placed_box(name: str, size: tuple[float, float, float], colour: str) -> PlacedBody:
    """Return a box that stands on the floor where an episode puts it: its extent [m], a name of `PALETTE`."""
    shape = Shape(geometry=Box(size=size), rgba=PALETTE[colour])
    return PlacedBody(name=name, T_world_body=Pose3.from_xyz_rpy((0.0, 0.0, size[2] / 2.0)), shapes=(shape,))
