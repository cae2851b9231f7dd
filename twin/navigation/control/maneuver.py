"""A few moves to and fro that free a robot where its controller finds no command, as a driver would park.

A controller looks a second ahead along one curve. Between a rack and somebody who stands still that is not
enough: a long robot has to back up a little and turn before it can go on. Here poses are searched, the whole
footprint at each, from where the robot is to the path ahead of it: an A* over (x, y, heading) whose moves are
short arcs, forwards or backwards, and turns in place (the state lattice of Pivtoraiko, Knepper, Kelly 2009).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.control.maneuver_config import ManeuverConfig
from twin.navigation.control.maneuver_kernel import contact, keeps_clear, most_contact, search
from twin.navigation.control.rotation import turn_rate
from twin.navigation.costmaps.costmap import Costmap, triple
from twin.navigation.costmaps.footprint import padded

_BINS = 48
_TURN = 2.0 * math.pi / _BINS
_CELL = 0.05
"""Places that are told apart [m]; those of a coarser costmap are."""
_STEP = 1.5
"""Of a move, in such cells: so long that it always leaves its cell, also across the corner."""
_NEAR, _TURNED = 0.015, 0.03
"""A move is over this near to its end [m], [rad]."""
_MARGIN = 0.025
"""Around the footprint [m], for a robot is a little beside the poses that it follows; where a way has it not
it is dear."""
_AHEAD = 5
"""So many poses ahead the robot may have come since the last command."""
_LOOKAHEAD = 0.2
"""Of the pursuit of a move's poses [m]."""
_LOOK, _LOOK_TURN = 0.1, 0.3
"""How far ahead a maneuver is checked while it is driven [m], [rad]: more than the way to stop."""


@dataclass(frozen=True)
class Move:
    """A run of poses in one gear."""

    gear: int
    """1 forwards, -1 backwards, 0 a turn in place, of less than half a circle."""
    poses: Array
    """Shape (n, 3), n >= 2: x, y [m], yaw [rad]."""
    step: float
    """Between them, if it is no turn [m]."""

    def left(self, at: Pose2, nearest: int) -> float:
        """Return what is left of it for a robot at a pose: [m], or signed [rad].

        Args:
            at: Where the robot is.
            nearest: The pose that it has come to.
        """
        x, y, yaw = self.poses[-1].tolist()
        if not self.gear:
            return wrap_angle(yaw - at.yaw)
        between = len(self.poses) - 1 - nearest
        if between > 1:
            return between * self.step
        return self.gear * ((x - at.x) * math.cos(yaw) + (y - at.y) * math.sin(yaw))

    def nearest(self, at: Pose2, since: int) -> int:
        """Return which pose a robot has come to that was at `since` before; the way may cross itself."""
        near = self.poses[since : since + _AHEAD]
        return since + int(np.argmin((near[:, 0] - at.x) ** 2 + (near[:, 1] - at.y) ** 2))

    def is_over(self, left: float) -> bool:
        """Whether that is next to nothing."""
        return left < _NEAR if self.gear else abs(left) < _TURNED


def find_maneuver(
    costmap: Costmap, footprint: ArrayLike, start: Pose2, path: Array, config: ManeuverConfig | None = None
) -> list[Move]:
    """Return the moves, in order, that lead from a blocked pose on to the path; none if there are none.

    Args:
        costmap: Around the robot.
        footprint: Corners in the base frame, shape (n, 2) [m].
        start: In the costmap's frame.
        path: What is ahead, shape (n, 3), n >= 1, from the pose nearest to the robot on; in that frame, too.
        config: Prices and limits.
    """
    config = config or ManeuverConfig()
    corners = np.array(footprint, dtype=np.float64, order="C")
    targets = _targets(costmap, corners, path, config)
    cell = max(_CELL, costmap.resolution)
    side = 2 * math.ceil(config.reach / cell) + 1
    if not len(targets) or side == 1:
        return []
    steps = _steps(config, cell)
    swept = max(_STEP * cell, _TURN * float(np.hypot(corners[:, 0], corners[:, 1]).max()))
    poses, moves = search(
        costmap.costs,
        corners,
        padded(corners, _MARGIN),
        costmap.frame,
        np.array([start.x, start.y, start.yaw], dtype=np.float64),
        targets,
        steps,
        side,
        cell,
        _BINS,
        math.ceil(swept / costmap.resolution),
        1.5 * cell,
        1.5 * _TURN,
        config.cost_penalty,
        config.cusp_penalty,
    )
    return _moves_of(poses, np.sign(steps[moves[1:], 0]).astype(int).tolist(), _STEP * cell)


@dataclass(kw_only=True)
class Maneuver:
    """Drives what `find_maneuver` found; made for one robot, used again and again."""

    footprint: Array
    config: ManeuverConfig = field(default_factory=ManeuverConfig)

    def __post_init__(self) -> None:
        self._moves: list[Move] = []
        self._nearest = 0
        """The pose of the first move that the robot has come to."""
        self._most = 0
        """How much the footprint may touch: hardly more than at the beginning, nothing once it is free."""
        self.speed_limit: float | None = None
        """[m/s]"""

    @property
    def active(self) -> bool:
        """Whether there is something left to drive."""
        return bool(self._moves)

    def begin(self, costmap: Costmap, at: Pose2, path: Array) -> bool:
        """Look for a way on; return whether there is one. Arguments as those of `find_maneuver`."""
        touched = contact(costmap.costs, self.footprint, triple(at), costmap.frame)
        # A way along a thing is never driven exactly.
        self._most, self._nearest = most_contact(most_contact(touched)), 0
        self._moves = find_maneuver(costmap, self.footprint, at, path, self.config)
        return self.active

    def drop(self) -> None:
        """Drive no further."""
        self._moves = []

    def command(
        self, at: Pose2, velocity: tuple[float, float], costmap: Costmap, dt: float
    ) -> tuple[float, float] | None:
        """Return the command (v [m/s], w [rad/s]); None when it is done, or something came into the way.

        Args:
            at: Of the base, in the costmap's frame.
            velocity: The present (v, w).
            costmap: Around the robot.
            dt: Control period [s].
        """
        if not contact(costmap.costs, self.footprint, triple(at), costmap.frame):
            self._most = 0
        while self._moves:
            move = self._moves[0]
            self._nearest = move.nearest(at, self._nearest) if move.gear else 0
            left = move.left(at, self._nearest)
            if move.is_over(left):
                self._moves.pop(0)
                self._nearest = 0
                continue
            command = self._drive(move, at, left, velocity, dt)
            if self._is_free(at, command, left, costmap):
                return command
            self._moves = []
        return None

    def _drive(
        self, move: Move, at: Pose2, left: float, velocity: tuple[float, float], dt: float
    ) -> tuple[float, float]:
        if not move.gear:
            limits = {"max_rate": self.config.turn_speed, "acceleration": self.config.turn_acceleration}
            return 0.0, turn_rate(left, velocity[1], dt, **limits)
        local = at.inverse().apply(move.poses[:, :2])
        nearest = self._nearest
        ahead = nearest + int(np.argmax(np.hypot(*local[nearest:].T) > _LOOKAHEAD))
        if ahead == nearest:
            # Beyond the end, straight on: the lookahead stays as long as it was.
            heading, over = float(move.poses[-1, 2]) - at.yaw, move.gear * _LOOKAHEAD
            x = float(local[-1, 0]) + over * math.cos(heading)
            y = float(local[-1, 1]) + over * math.sin(heading)
        else:
            x, y = local[ahead].tolist()
        config = self.config
        most = config.speed if self.speed_limit is None else min(config.speed, self.speed_limit)
        speed = min(most, math.sqrt(2.0 * config.acceleration * left))
        speed = move.gear * min(speed, max(move.gear * velocity[0], 0.0) + config.acceleration * dt)
        curvature = 2.0 * y / max(x * x + y * y, 1e-6)
        bound = config.turn_speed / max(abs(speed), 1e-6)
        return speed, speed * min(max(curvature, -bound), bound)

    def _is_free(self, at: Pose2, command: tuple[float, float], left: float, costmap: Costmap) -> bool:
        """Whether the robot may do this for as far as it needs to stop, or for what is left of the move."""
        v, w = command
        size = abs(v) or max(abs(w), 1e-6)
        dt = min(_LOOK if v else _LOOK_TURN, abs(left)) / size / 5.0
        costs, frame = costmap.costs, costmap.frame
        return bool(keeps_clear(costs, self.footprint, self._most, triple(at), command, dt, 5, frame))


def _moves_of(poses: Array, gears: list[int], step: float) -> list[Move]:
    """Cut a way where the gear changes, and turns of half a circle so that they tell the way round."""
    moves, at = [], 0
    for gear, group in itertools.groupby(gears):
        left = len(list(group))
        while left:
            count = left if gear else min(left, _BINS // 3)
            moves.append(Move(gear, poses[at : at + count + 1], step))
            at, left = at + count, left - count
    return moves


def _steps(config: ManeuverConfig, cell: float) -> Array:
    """Return way [m], turn [rad] and price [m] of each, shape (8, 3)."""
    step = _STEP * cell
    arcs = [(step, turn, step) for turn in (0.0, _TURN, -_TURN)]
    back = [(-step, turn, step * config.reverse_penalty) for turn in (0.0, _TURN, -_TURN)]
    turns = [(0.0, turn, config.turn_price * _TURN) for turn in (_TURN, -_TURN)]
    return np.array([*arcs, *back, *turns])


def _targets(costmap: Costmap, corners: Array, path: Array, config: ManeuverConfig) -> Array:
    """Return where on the path the robot may stand and go on, shape (m, 3)."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])
    wanted = (along >= min(config.ahead_min, along[-1])) & (along <= config.ahead_max)
    free = [
        (x, y, yaw)
        for x, y, yaw in path[wanted]
        if costmap.contains(x, y) and not contact(costmap.costs, corners, (x, y, yaw), costmap.frame)
    ]
    return np.array(free).reshape(-1, 3)
