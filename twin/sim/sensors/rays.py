"""Rays from a link into the world."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.sim.compose import GROUP_COLLISION, GROUP_SOLID
from twin.sim.sensors.culling import BodiesInReach, FanSlice, PyramidSlice, RayBounds
from twin.sim.sensors.sensor import Mount


class RayBuffers(NamedTuple):
    """What casters write into; those that are asked in turns may share it, and have it in the cache then."""

    geoms: NDArray[np.int32]
    distances: Array
    normals: Array
    directions: Array

    @classmethod
    def of(cls, n: int) -> RayBuffers:
        """Return room for `n` rays."""
        return cls(np.full(n, -1, np.int32), np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)))


class RayCaster:
    """Casts a fan of rays from the origin of a link; that link itself is not hit."""

    def __init__(
        self,
        mount: Mount,
        directions: Array,
        *,
        cutoff: float,
        aims: bool = False,
        buffers: RayBuffers | None = None,
    ) -> None:
        """Bind to a world.

        Args:
            mount: The link.
            directions: Unit vectors in the link's frame, shape (n, 3).
            cutoff: Shapes farther than this need not be found [m].
            aims: Whether `aim` is going to turn them elsewhere.
            buffers: Room for as many rays or more, if others share it.
        """
        self._model, self._data = mount.world.model, mount.world.data
        self._body = mount.body_id
        self.own_directions = np.ascontiguousarray(directions)
        """Unit vectors in the link's frame, shape (n, 3)."""
        self._groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
        self._groups[[GROUP_SOLID, GROUP_COLLISION]] = 1
        n = len(directions)
        room = RayBuffers.of(n) if buffers is None else buffers
        self._geoms, self._distance = room.geoms[:n], room.distances[:n]
        self.normals = room.normals[:n]
        """Surface normals of the last cast, in the world frame, shape (n, 3)."""
        self.directions = room.directions[:n]
        """Directions of the last cast, in the world frame, shape (n, 3)."""
        self._cutoff = cutoff
        savings = mount.world.savings
        # Rays that are turned about are no plane's, even if the first ones fill one.
        known = np.eye(3) if aims else self.own_directions
        self._bounds = RayBounds(self._model, self._groups, savings)
        self._slice = FanSlice(self._model, known, self._groups, savings)
        self._pyramid = PyramidSlice(self._model, known, self._groups, savings)
        self._bodies = BodiesInReach(self._model, known, self._groups, cutoff, savings)
        if aims:
            self.aim(directions)

    def aim(self, directions: Array) -> None:
        """Take as many other directions, of a caster that `aims`."""
        self.own_directions[:] = directions
        self._pyramid.aim(self.own_directions)
        self._bodies.aim(self.own_directions)

    def cast(self) -> Array:
        """Return the distances, shape (n,) [m]; inf for no hit. A few may lie beyond the cutoff.

        They, and what else it found, stay so until the next cast.
        """
        data = self._data
        np.matmul(self.own_directions, data.xmat[self._body].reshape(3, 3).T, out=self.directions)
        self._slice.look(data, self._body)
        self._pyramid.look(data, self._body)
        self._bodies.look(data, self._body)
        with self._bounds, self._slice, self._pyramid, self._bodies:
            mujoco.mj_multiRay(
                self._model,
                data,
                data.xpos[self._body],
                self.directions.reshape(-1),
                self._groups,
                True,
                self._body,
                self._geoms,
                self._distance,
                self.normals.reshape(-1),
                len(self._distance),
                self._cutoff,
            )
        self._distance[self._distance < 0.0] = np.inf
        return self._distance

    def cosines(self) -> Array:
        """Return the cosines of the angles between rays and surfaces of the last cast, shape (n,)."""
        cosines: Array = np.einsum("ij,ij->i", self.directions, self.normals)
        return np.abs(cosines)
