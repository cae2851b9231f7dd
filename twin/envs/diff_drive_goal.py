"""`twin/DiffDriveGoal-v0`: diff_bot drives to a point in a room with boxes in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np

from twin.envs.gym_envs import NavigationEnv, NavigationVectorEnv
from twin.envs.navigation import Course, Layout, Navigation, NavigationConfig, placed_box
from twin.envs.randomisation import Episode
from twin.envs.robot import DrivenRobot
from twin.errors import GymError
from twin.geometry import Array, Pose2, Pose3
from twin.models.shapes import Box
from twin.sim.scene import Scene, Shape, StaticBody
from twin.warehouse.arena_scene import PALETTE

_WALL, _HEIGHT = 0.1, 0.5
_TRIES, _LAST_TRY = 30, 100


@dataclass(frozen=True, kw_only=True)
class DiffDriveGoalConfig(NavigationConfig):
    """A room with boxes in it; start, goal and boxes are elsewhere in each episode."""

    robot: str = "diff_bot"
    """Name of a robot of the catalogue, or its file; it needs a drive and a lidar."""
    room: tuple[float, float] = (8.0, 8.0)
    """Inner size of the room along x and y; the world's origin is its middle [m]."""
    boxes: tuple[tuple[float, float], ...] = (
        (0.4, 0.4),
        (0.4, 0.4),
        (0.6, 0.3),
        (0.6, 0.3),
        (1.0, 0.3),
        (0.5, 0.5),
    )
    """Sizes of the boxes on the floor [m]."""
    gap: float = 0.7
    """Between boxes, and from them to walls, start and goal, at least [m]: the robot gets through."""
    least_distance: float = 2.0
    """From start to goal, at least [m]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        inner = self.inner
        if not (inner.min() > 0.0 and self.least_distance < 2.0 * math.hypot(*inner) < math.inf):
            x, y = self.room
            raise GymError(
                f"a room of {x:g} m x {y:g} m has no start and goal {self.least_distance:g} m apart which "
                f"keep {self.gap:g} m from its walls; valid: a larger room, or less least_distance or gap"
            )

    @property
    def inner(self) -> Array:
        """How far start and goal may be from the middle along x and y, shape (2,) [m]."""
        return np.array(self.room) / 2.0 - self.gap


class Room(Course):
    """Walls around boxes."""

    def __init__(self, config: DiffDriveGoalConfig) -> None:
        self.config = config
        boxes = tuple(
            placed_box(f"box_{i}", (*size, _HEIGHT), "orange") for i, size in enumerate(config.boxes)
        )
        self.scene = self.looks = Scene(name="room", statics=tuple(self._walls()), placed=boxes)
        self.overview = 1.3 * max(config.room)
        self._radii = [math.hypot(*size) / 2.0 for size in config.boxes]

    def _walls(self) -> list[StaticBody]:
        x, y = self.config.room
        across, along = (_WALL, y + 2.0 * _WALL, _HEIGHT), (x, _WALL, _HEIGHT)
        places = [(side * (x + _WALL) / 2.0, 0.0, across) for side in (1, -1)]
        places += [(0.0, side * (y + _WALL) / 2.0, along) for side in (1, -1)]
        return [
            StaticBody(
                name=f"wall_{i}",
                T_world_body=Pose3.from_xyz_rpy((px, py, _HEIGHT / 2.0)),
                shapes=(Shape(geometry=Box(size=size), rgba=PALETTE["white"]),),
            )
            for i, (px, py, size) in enumerate(places)
        ]

    def layout(self, episode: Episode) -> Layout:
        """Return start, goal and as many boxes as find a place with the gap around them."""
        config = self.config
        inner, tries = config.inner, count()
        for attempt in tries:
            u = 2.0 * episode.uniform(attempt, 5) - 1.0
            if attempt == _LAST_TRY:  # where hardly any two places are so far apart
                u[:4] = -1.0, -1.0, 1.0, 1.0
            start, goal, yaw = u[:2] * inner, u[2:4] * inner, math.pi * float(u[4])
            if math.dist(start, goal) >= config.least_distance:
                break
        middles, radii = np.array([start, goal]), np.zeros(2)
        placed: list[Pose2 | None] = []
        for radius in self._radii:
            u = 2.0 * episode.uniform(next(tries), 3 * _TRIES).reshape(_TRIES, 3) - 1.0
            tried = u[:, :2] * (inner - radius)
            away = tried[:, None] - middles
            fits = ((away * away).sum(axis=2) >= (radii + (radius + config.gap)) ** 2).all(axis=1)
            free = np.flatnonzero(fits & (inner.min() > radius))
            placed.append(None)
            if len(free):
                x, y = tried[free[0]].tolist()
                placed[-1] = Pose2(x, y, math.pi * float(u[free[0], 2]))
                middles, radii = np.vstack((middles, (x, y))), np.append(radii, radius)
        (x, y), (goal_x, goal_y) = start.tolist(), goal.tolist()
        return Layout(Pose2(x, y, yaw), (goal_x, goal_y), placed)


def _navigation(config: DiffDriveGoalConfig | None, n: int, threads: int) -> Navigation:
    config = config or DiffDriveGoalConfig()
    robot = DrivenRobot(config.robot, timestep=config.timestep)
    return Navigation(config, Room(config), robot, n, threads)


class DiffDriveGoalEnv(NavigationEnv):
    """One robot in one room."""

    def __init__(self, *, config: DiffDriveGoalConfig | None = None, render_mode: str | None = None) -> None:
        super().__init__(_navigation(config, 1, 1), render_mode)


class DiffDriveGoalVectorEnv(NavigationVectorEnv):
    """n robots, each in a room of its own."""

    def __init__(
        self,
        num_envs: int = 1,
        *,
        config: DiffDriveGoalConfig | None = None,
        threads: int = 0,
        **options: Any,
    ) -> None:
        """Take their number, the threads that share them (0: one for each CPU), and what the base takes."""
        super().__init__(_navigation(config, num_envs, threads), **options)
