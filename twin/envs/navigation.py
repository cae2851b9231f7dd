"""Driving to goals past obstacles: what observations, actions and rewards are, for n environments at once."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import NDArray

from twin.envs import kernels
from twin.envs.kernels import Floats32
from twin.envs.randomisation import Episode, Randomisation
from twin.envs.robot import DrivenRobot
from twin.envs.simulations import ALL, Rows, Simulations
from twin.errors import GymError, nearest
from twin.geometry import Array, Pose2, quat_wxyz_from_yaw
from twin.sim.scene import Scene

_HIDDEN_M = -20.0
"""Height of what is not there in an episode: no ray and no robot comes so low."""
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


class Navigation:
    """n environments on one course, without any convention of gymnasium's on top."""

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
        drive = robot.drive
        self._fastest = np.array([drive.linear.max_velocity, drive.angular.max_velocity])
        self._low, self._high = self._bounds(robot)
        actions: Space[Any] = Box(-1.0, 1.0, (2,), np.float32)
        observations: Space[Any] = Box(self._low, self._high, dtype=np.float32)
        self.spaces = actions, observations
        """Of one environment."""
        self._episodes = [Episode(0, 0)] * n
        self.steps = np.zeros(n, np.int64)
        """Steps since the start of each episode."""
        self.layouts: list[Layout | None] = [None] * n
        """Of the present episodes."""
        self._goals, self._starts = np.zeros((n, 2)), np.zeros((n, 3))
        self._actions, self._distance = np.zeros((n, 2)), np.zeros(n)
        self._noise = np.zeros((n, config.beams))

    def _bounds(self, robot: DrivenRobot) -> tuple[Floats32, Floats32]:
        v, w = 1.5 * self._fastest
        low = np.concatenate(([0.0, -1.0, -1.0, -v, -w, -1.0, -1.0], np.zeros(self.config.beams)))
        far = np.full(self.config.beams, robot.lidar.range_max)
        high = np.concatenate(([self.config.goal_range, 1.0, 1.0, v, w, 1.0, 1.0], far))
        return low.astype(np.float32), high.astype(np.float32)

    def begin(self, i: int, episode: Episode, options: Mapping[str, Any] | None = None) -> None:
        """Let environment `i` begin an episode; `options` may say where `start` and `goal` are."""
        layout = _with_options(self.course.layout(episode), options)
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
        self._distance[i] = self.distances()[i]

    def act(self, actions: Array) -> Outcome:
        """Take a step with actions of the action space, shape (n, 2).

        Raises:
            SimulationError: The physics of one diverged.
        """
        simulations, reward = self.simulations, self.config.reward
        self._actions = np.clip(actions, -1.0, 1.0)
        wanted = self._actions * self._fastest
        collision = np.zeros(self.count, np.bool_)
        for _ in range(self._ticks):
            collision |= simulations.tick(wanted)
        simulations.check()
        self.steps += 1
        distance = self.distances()
        success = (distance <= self.config.goal_tolerance) & ~collision
        value = reward.progress * (self._distance - distance) + reward.step
        value += reward.goal * success + reward.collision * collision
        self._distance = distance
        return Outcome(value, success, collision, distance.copy())

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
        ranges = simulations.scan(simulations.hits(rows), noise, rows)
        odometry = simulations.states.odometry[rows]
        polar = np.empty((len(odometry), 3))
        kernels.locate(self._starts[rows], odometry, self._goals[rows], polar)
        found = np.concatenate((polar, odometry[:, 3:], self._actions[rows], ranges), axis=1)
        return np.clip(found.astype(np.float32), self._low, self._high)


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
