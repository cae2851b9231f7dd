"""Rays from a link into the world."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.geometry import Array
from twin.sim.compose import GROUP_COLLISION, GROUP_SOLID
from twin.sim.sensors.culling import BodiesInReach, FanSlice, PyramidSlice, RayBounds
from twin.sim.sensors.sensor import Mount


class RayCaster:
    """Casts a fixed fan of rays from the origin of a link; that link itself is not hit."""

    def __init__(self, mount: Mount, directions: Array, *, cutoff: float) -> None:
        """Bind to a world.

        Args:
            mount: The link.
            directions: Unit vectors in the link's frame, shape (n, 3).
            cutoff: Shapes farther than this need not be found [m].
        """
        self._model, self._data = mount.world.model, mount.world.data
        self._body = mount.body_id
        self._directions = np.ascontiguousarray(directions)
        n = len(directions)
        self._groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
        self._groups[[GROUP_SOLID, GROUP_COLLISION]] = 1
        self._geoms = np.full(n, -1, dtype=np.int32)
        self._distance = np.zeros(n)
        self.normals = np.zeros((n, 3))
        """Surface normals of the last cast, in the world frame, shape (n, 3)."""
        self.directions = np.zeros((n, 3))
        """Directions of the last cast, in the world frame, shape (n, 3)."""
        self._cutoff = cutoff
        savings = mount.world.savings
        self._bounds = RayBounds(self._model, self._groups, savings)
        self._slice = FanSlice(self._model, self._directions, self._groups, savings)
        self._pyramid = PyramidSlice(self._model, self._directions, self._groups, savings)
        self._bodies = BodiesInReach(self._model, self._directions, self._groups, cutoff, savings)

    def cast(self) -> Array:
        """Return the distances, shape (n,) [m]; inf for no hit. A few may lie beyond the cutoff."""
        data = self._data
        np.matmul(self._directions, data.xmat[self._body].reshape(3, 3).T, out=self.directions)
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
        return np.where(self._distance < 0.0, np.inf, self._distance)
