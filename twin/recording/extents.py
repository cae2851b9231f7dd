"""How large things are that views must hold: each robot, and the floor on which all happens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.mesh.meshes import read_mesh
from twin.models.shapes import Geometry, Mesh
from twin.models.solids import reach

if TYPE_CHECKING:
    from twin.sim.shapes import BodyShape
    from twin.sim.world import World

_LEAST_ROBOT = 0.05
"""Edge of the box around a robot without shapes [m]."""
_ROOM = 1.0
"""By which part of its size a stage grows beyond a robot that leaves it: it does so only a few times."""


def bounds(shapes: Iterable[BodyShape], pose_of: Callable[[str], Pose3]) -> tuple[Array, Array]:
    """Return the corners of the box around shapes [m], shapes (3,), in the frame in which `pose_of` is.

    Without shapes, the lower one is infinite and the upper one minus infinite.
    """
    corners = [(np.full(3, np.inf), np.full(3, -np.inf))]
    for shape in shapes:
        pose = pose_of(shape.body) @ shape.T_body_geometry
        near, far = span(shape.geometry, matrix_from_quat_wxyz(pose.quat_wxyz))
        corners.append((pose.xyz + near, pose.xyz + far))
    low, high = np.swapaxes(corners, 0, 1)
    return low.min(axis=0), high.max(axis=0)


def span(geometry: Geometry, R: Array) -> tuple[Array, Array]:
    """Return the corners [m] of the box around a shape that is turned by R, seen from its origin.

    Raises:
        ModelError: The mesh cannot be read.
    """
    if isinstance(geometry, Mesh):
        mesh = read_mesh(geometry.path, apply_up_axis=geometry.apply_up_axis)
        points = (mesh.points * geometry.scale) @ R.T
        return points.min(axis=0), points.max(axis=0)
    half = np.array([reach(geometry, row) for row in R.tolist()])
    return -half, half


@dataclass(frozen=True, kw_only=True)
class RobotBox:
    """The box around a robot at the start, in the frame of its base."""

    robot: str
    base: str
    """The body that a view of the robot travels with."""
    low: Array
    """Shape (3,) [m]."""
    high: Array
    """Shape (3,) [m]."""

    @property
    def centre(self) -> Array:
        """Shape (3,) [m]."""
        return (self.low + self.high) / 2.0

    @property
    def size(self) -> float:
        """Length of the box's diagonal [m]."""
        return float(np.linalg.norm(self.high - self.low))

    @property
    def radius(self) -> float:
        """Half of how long or wide it is on the floor [m]."""
        return float(np.max((self.high - self.low)[:2])) / 2.0


def robot_box(world: World, shapes: Iterable[BodyShape], robot: str) -> RobotBox:
    """Measure a robot as it stands now."""
    links = [name for name in world.body_names if name.startswith(f"{robot}/")]
    base = f"{robot}/base_link" if f"{robot}/base_link" in links or not links else links[0]
    T_base_world = world.pose(base).inverse() if links else Pose3.from_xyz_rpy()
    own = [shape for shape in shapes if shape.body.startswith(f"{robot}/")]
    low, high = bounds(own, lambda body: T_base_world @ world.pose(body))
    low, high = np.minimum(low, -_LEAST_ROBOT / 2.0), np.maximum(high, _LEAST_ROBOT / 2.0)
    return RobotBox(robot=robot, base=base, low=low, high=high)


class Floor(NamedTuple):
    """A rectangle of floor that views show."""

    low: Array
    """x, y [m], shape (2,)."""
    high: Array
    """x, y [m], shape (2,)."""


class Stage:
    """The rectangle of floor that views show: all shapes at the start, and wherever robots go."""

    def __init__(self, world: World, shapes: Sequence[BodyShape], robots: Sequence[RobotBox]) -> None:
        """Measure what is there now."""
        low, high = bounds(shapes, world.pose)
        self._low, self._high = np.minimum(low[:2], -1.0), np.maximum(high[:2], 1.0)
        self._reach = max((box.size for box in robots), default=0.0) / 2.0
        self.visit(np.array([world.pose(box.base).xyz for box in robots]).reshape(-1, 3))
        self.low, self.high = self._low, self._high

    def visit(self, xyz: Array) -> None:
        """Take note of where the bases of robots are, shape (n, 3) [m]; what is not finite is no place."""
        xy = xyz[np.isfinite(xyz).all(axis=1), :2]
        if len(xy):
            self._low = np.minimum(self._low, xy.min(axis=0) - self._reach)
            self._high = np.maximum(self._high, xy.max(axis=0) + self._reach)

    def grow(self) -> bool:
        """Make room for robots that have left the rectangle, and some more; tell whether any had."""
        if (self._low >= self.low).all() and (self._high <= self.high).all():
            return False
        room = _ROOM * (self._high - self._low)
        self.low = np.where(self._low < self.low, self._low - room, self.low)
        self.high = np.where(self._high > self.high, self._high + room, self.high)
        return True

    def fit(self) -> None:
        """Shrink to what was needed."""
        self.low, self.high = self._low, self._high
