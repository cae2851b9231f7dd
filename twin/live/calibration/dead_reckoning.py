"""The way of a differential drive from how far its wheels turned, as a function of what is calibrated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from twin.geometry import Array

PARAMETERS = (
    "wheel_radius",
    "difference",
    "track",
    "slip",
    "side_slip",
    "lidar_x",
    "lidar_y",
    "lidar_yaw",
    "lidar_delay",
)
"""Of `Increments`: the mean radius of the wheels, as a factor of that believed; left minus right, as a share;
the track, as a factor; longitudinal slip per acceleration [s²/m]; sliding outwards per centripetal
acceleration [s]; the pose of the lidar in the frame of the base [m, rad]; how late its stamps are by those
of the wheels [s]."""
MOUNT = slice(5, 8)
"""Of the lidar, in `PARAMETERS`."""
DELAY = 8


@dataclass(frozen=True, kw_only=True)
class Wheels:
    """How far the wheels of each side have turned."""

    time: Array
    """Increasing, shape (n,) [s]."""
    left: Array
    """Mean of the side's wheels, shape (n,) [rad]."""
    right: Array
    """Likewise."""


def compose(a: Array, b: Array) -> Array:
    """Return `T_a @ T_b` of poses in the plane, shapes (..., 3)."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + c * b[..., 0] - s * b[..., 1]
    y = a[..., 1] + s * b[..., 0] + c * b[..., 1]
    return np.stack(np.broadcast_arrays(x, y, a[..., 2] + b[..., 2]), axis=-1)


def inverse(a: Array) -> Array:
    """Return the inverse of poses in the plane, shape (..., 3)."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack([-c * a[..., 0] - s * a[..., 1], s * a[..., 0] - c * a[..., 1], -a[..., 2]], axis=-1)


class Increments:
    """The motions of the base between instants."""

    def __init__(self, wheels: Wheels, instants: Array, wheel_radius: float, track: float) -> None:
        """Interpolate the wheels.

        Args:
            wheels: As measured.
            instants: Increasing, within the times of the wheels, shape (k + 1,) [s].
            wheel_radius: That is believed [m].
            track: That is believed, effective [m].
        """
        within = wheels.time[(wheels.time > instants[0]) & (wheels.time < instants[-1])]
        grid = np.union1d(instants, within)
        self._first = np.searchsorted(grid, instants)[:-1]
        self._interval = np.searchsorted(instants, grid[:-1], side="right") - 1
        self._grid, self._durations = grid, np.diff(grid)
        self._middles = (grid[1:] + grid[:-1]) / 2.0
        self._splines = [
            CubicSpline(wheels.time, side * wheel_radius) for side in (wheels.left, wheels.right)
        ]
        self._track = track
        left, right = (np.add.reduceat(np.abs(way), self._first) for way in self._ways(0.0))
        self.distance = (left + right) / 2.0
        """That each side's wheels rolled on average, shape (k,) [m]."""
        self.seconds = np.diff(instants)
        """Shape (k,) [s]."""

    def _ways(self, delay: float) -> list[Array]:
        return [np.diff(spline(self._grid - delay)) for spline in self._splines]

    def base(self, values: Array) -> Array:
        """Return the motions of the base, shape (k, 3), by values of `PARAMETERS`, shape (9,)."""
        radius, difference, track, slip, side_slip = values[:5]
        sides = []
        for spline, way in zip(self._splines, self._ways(values[DELAY]), strict=True):
            # Creep of a tyre grows with the force that it transmits, so with the acceleration.
            creep = slip * spline(self._middles - values[DELAY], 2) if slip else 0.0
            sides.append(way * (1.0 - creep) * radius)
        left, right = sides[0] * (1.0 + difference / 2.0), sides[1] * (1.0 - difference / 2.0)
        way, turn = (left + right) / 2.0, (right - left) / (track * self._track)
        turned = np.cumsum(turn)
        before = (turned[self._first] - turn[self._first])[self._interval]
        heading = turned - turn / 2.0 - before
        chord = way * np.sinc(turn / (2.0 * np.pi))
        outwards = side_slip * way * turn / self._durations
        c, s = np.cos(heading), np.sin(heading)
        sums = (chord * c + outwards * s, chord * s - outwards * c, turn)
        return np.column_stack([np.add.reduceat(each, self._first) for each in sums])

    def lidar(self, values: Array) -> Array:
        """Return the motions of the lidar in its own frame, shape (k, 3)."""
        mount = values[MOUNT]
        return compose(compose(inverse(mount), self.base(values)), mount)
