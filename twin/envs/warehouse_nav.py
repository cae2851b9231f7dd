"""`twin/WarehouseNav-v0`: warehouse_bot drives through the arena, past boxes and who walks there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count, pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from twin.envs import kernels
from twin.envs.gym_envs import NavigationEnv, NavigationVectorEnv
from twin.envs.navigation import Course, Layout, Navigation, NavigationConfig, placed_box
from twin.envs.randomisation import Episode
from twin.envs.robot import DrivenRobot
from twin.envs.simulations import Rows
from twin.envs.walkers import WalkerConfig, Walkers
from twin.envs.ways import Ways
from twin.errors import GymError
from twin.geometry import Array, Pose2
from twin.models.shapes import Box
from twin.sim.scene import Shape, StaticBody
from twin.warehouse import arena as arenas
from twin.warehouse.map_files import map_of_arena

_LOW = 0.3
"""What begins higher stands on what a robot touches, and its lidar sees, first [m]."""
_TRIES, _LAST_TRY = 50, 1000
_BOX_HEIGHT = 0.5
_GOALS = 1.0
"""Goals are on a lattice of this spacing [m]: the ways to each are worked out once."""

WALKERS = (
    WalkerConfig(size=(0.4, 0.4, 1.2), route=((-5.6, 2.2), (5.0, 2.2))),
    WalkerConfig(size=(0.4, 0.4, 1.2), route=((4.2, -1.3), (-7.5, -1.3), (-7.5, 3.0)), speed=0.4),
    WalkerConfig(size=(0.9, 0.6, 0.9), route=((6.0, -4.6), (-4.0, -4.9)), speed=0.3),
)
"""Two people and a cart, as in scenarios/warehouse_patrol.yaml."""


@dataclass(frozen=True, kw_only=True)
class WarehouseNavConfig(NavigationConfig):
    """An arena; start, goal, boxes and walkers are elsewhere in each episode."""

    robot: str = "warehouse_bot"
    """Name of a robot of the catalogue, or its file; it needs a drive and a lidar."""
    goal_range: float = 25.0
    """Goals farther away are observed as so far [m]."""
    arena: str = "warehouse"
    """Name of an arena, or its file."""
    robot_radius: float = 0.5
    """Ways on the map keep so far from what is on it [m]."""
    ahead: float = 1.6
    """How far along the way on the map the point is that is observed beside the goal [m]."""
    least_distance: float = 4.0
    """From start to goal, at least [m]."""
    boxes: tuple[tuple[float, float], ...] = ((0.5, 0.4), (0.5, 0.4), (0.6, 0.6))
    """Sizes of boxes on the floor that are not on the map [m]."""
    gap: float = 1.2
    """From the middle of a box to what is on the map, start, goal, routes and other boxes, at least [m]."""
    walkers: tuple[WalkerConfig, ...] = field(default=WALKERS)
    """Who walks there."""
    localisation_bias: tuple[float, float] = (0.03, 0.01)
    """Standard deviation of an episode's error of localisation, along x and y [m], of yaw [rad]."""
    localisation_noise: tuple[float, float] = (0.01, 0.005)
    """Standard deviation of a step's error beside it, along x and y [m], of yaw [rad]."""


class Aisles(Course):
    """What of an arena a driving robot can meet."""

    overview = None

    def __init__(self, config: WarehouseNavConfig) -> None:
        self.config = config
        arena = arenas.load(config.arena)
        boxes = tuple(
            placed_box(f"box_{i}", (*size, _BOX_HEIGHT), "orange") for i, size in enumerate(config.boxes)
        )
        walkers = tuple(
            placed_box(f"walker_{i}", walker.size, "yellow") for i, walker in enumerate(config.walkers)
        )
        whole = arena.scene()
        self.looks = replace(whole, placed=(*boxes, *walkers))
        self.scene = replace(self.looks, statics=tuple(_low(whole.statics)))
        self.ways = Ways(map_of_arena(arena), config.robot_radius)
        nodes = self.ways.nodes
        self._places = self.ways.passable
        self._goals = self.ways.lattice(_GOALS)
        if not len(self._goals):
            raise GymError(
                f"robot_radius is {config.robot_radius:g} m; valid: less, as then no place of arena "
                f"'{config.arena}' is far enough from what stands there"
            )
        away = np.array([_distance_to(walker.route, nodes[self._places]) for walker in config.walkers])
        off_routes = (away >= config.gap).all(axis=0) if len(away) else np.ones(len(self._places), np.bool_)
        self._for_boxes = self._places[off_routes & (self.ways.clearance[self._places] >= config.gap)]

        self._lengths: dict[int, Array] = {}

    def lengths(self, goal: tuple[float, float]) -> Array:
        """Return the lengths of the ways to a goal, shape as that of `ways` [m]."""
        node = self.ways.node_at(*goal)
        if node in self._lengths:
            return self._lengths[node]
        found = self.ways.lengths(node)
        if node in self._goals:  # all others are a user's, of which there may be any number
            self._lengths[node] = found
        return found

    def layout(self, episode: Episode) -> Layout:
        """Return start and goal anywhere on the ways, and as many boxes as find a place; no walkers."""
        config, nodes = self.config, self.ways.nodes
        tries = count()
        for attempt in tries:
            u = episode.uniform(attempt, 3)
            start = nodes[self._places[int(u[0] * len(self._places))]]
            goal = nodes[self._goals[int(u[1] * len(self._goals))]]
            if math.dist(start, goal) >= config.least_distance:
                break
            if attempt == _LAST_TRY:
                raise GymError(
                    f"least_distance is {config.least_distance:g} m; valid: less, as hardly any two places "
                    f"of arena '{config.arena}' are so far apart"
                )
        yaw = 2.0 * math.pi * float(u[2]) - math.pi
        taken = np.array([start, goal])
        placed: list[Pose2 | None] = []
        for _ in config.boxes:
            u = episode.uniform(next(tries), _TRIES + 1)
            tried = nodes[self._for_boxes[(u[:_TRIES] * len(self._for_boxes)).astype(np.intp)]]
            away = tried[:, None] - taken
            free = np.flatnonzero(((away * away).sum(axis=2) >= config.gap**2).all(axis=1))
            placed.append(None)
            if len(free):
                x, y = tried[free[0]].tolist()
                placed[-1] = Pose2(x, y, math.pi * float(u[_TRIES]))
                taken = np.vstack((taken, (x, y)))
        (x, y), (goal_x, goal_y) = start.tolist(), goal.tolist()
        return Layout(Pose2(x, y, yaw), (goal_x, goal_y), placed)


class WarehouseNavigation(Navigation):
    """n robots, each in an arena of its own."""

    POINTS: ClassVar[int] = 2
    NOISES: ClassVar[int] = 3

    def __init__(self, config: WarehouseNavConfig, n: int, threads: int) -> None:
        self._aisles = Aisles(config)
        self._walkers = Walkers(config.walkers, n)
        self._lengths = np.zeros((n, *self._aisles.ways.shape))
        self._bias = np.zeros((n, 3))
        (xy, yaw), (xy_noise, yaw_noise) = config.localisation_bias, config.localisation_noise
        self._spread = np.array([(xy, xy, yaw), (xy_noise, xy_noise, yaw_noise)])
        super().__init__(
            config, self._aisles, DrivenRobot(config.robot, timestep=config.timestep), n, threads
        )

    def _laid_out(self, i: int, episode: Episode, options: Mapping[str, Any] | None) -> Layout:
        layout = super()._laid_out(i, episode, options)
        self._walkers.begin(i, episode.walks(len(self._aisles.config.walkers)))
        self._lengths[i] = self._aisles.lengths(layout.goal)
        self._bias[i] = self._spread[0] * episode.constants(5)[2:]
        return layout._replace(placed=[*layout.placed, *self._walkers.poses(i)])

    def _before_tick(self) -> None:
        positions = self.simulations.mocap_pos[:, len(self._aisles.config.boxes) :]
        self._walkers.walk(self.config.control_period, self.simulations.root, positions)

    def _to_go(self, rows: Rows) -> Array:
        places = self.simulations.root[rows]
        way, points = np.empty(len(places)), np.empty((len(places), 2))
        self._aisles.ways.look_up(self._lengths[rows], places, 0.0, way, points)
        return way

    def _believed(self, rows: Rows, noise: Array) -> Array:
        """Return true poses with the error of a localisation."""
        roots = self.simulations.root[rows]
        poses, error = np.empty((len(roots), 3)), self._bias[rows] + self._spread[1] * noise
        kernels.flatten(roots, poses)
        return poses + error

    def _points(self, rows: Rows, poses: Array) -> Array:
        """Return goals, and the next points of the ways to them on the map."""
        goals = self._goals[rows]
        points = np.empty((len(goals), 2, 2))
        points[:, 0] = goals
        self._aisles.ways.look_up(
            self._lengths[rows], poses, self._aisles.config.ahead, np.empty(len(goals)), points[:, 1]
        )
        return points


def _low(statics: tuple[StaticBody, ...]) -> Iterator[StaticBody]:
    for static in statics:
        low = tuple(shape for shape in static.shapes if shape.solid and _bottom(static, shape) < _LOW)
        if low:
            yield replace(static, shapes=low)


def _bottom(static: StaticBody, shape: Shape) -> float:
    geometry = shape.geometry
    height = geometry.size[2] if isinstance(geometry, Box) else 0.0
    return float((static.T_world_body @ shape.T_body_geometry).xyz[2]) - height / 2.0


def _distance_to(route: tuple[tuple[float, float], ...], points: Array) -> Array:
    """Return how far points are from a route, shape (n,) [m]."""
    corners = np.array(route)
    nearest: NDArray[np.float64] = np.full(len(points), np.inf)
    for start, end in pairwise(corners):
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(points - start - share[:, None] * along).T))
    return nearest


class WarehouseNavEnv(NavigationEnv):
    """One robot in one arena."""

    def __init__(self, *, config: WarehouseNavConfig | None = None, render_mode: str | None = None) -> None:
        super().__init__(WarehouseNavigation(config or WarehouseNavConfig(), 1, 1), render_mode)


class WarehouseNavVectorEnv(NavigationVectorEnv):
    """n robots, each in an arena of its own."""

    def __init__(
        self, num_envs: int = 1, *, config: WarehouseNavConfig | None = None, threads: int = 0, **options: Any
    ) -> None:
        """Take their number, the threads that share them (0: one for each CPU), and what the base takes."""
        super().__init__(WarehouseNavigation(config or WarehouseNavConfig(), num_envs, threads), **options)
