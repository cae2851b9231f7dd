"""Rays from a link into the world."""

from __future__ import annotations

from collections.abc import Sequence
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
        bundle: tuple[PyramidSlice, int] | None = None,
    ) -> None:
        """Bind to a world.

        Args:
            mount: The link.
            directions: Unit vectors in the link's frame, shape (n, 3).
            cutoff: Shapes farther than this need not be found [m].
            aims: Whether `aim` is going to turn them elsewhere.
            buffers: Room for as many rays or more, if others share it.
            bundle: What looks beside bundles of rays, if others share it, and which of them is this one.
        """
        self._model, self._data = mount.world.model, mount.world.data
        self._body = mount.body_id
        self.own_directions = np.ascontiguousarray(directions)
        """Unit vectors in the link's frame, shape (n, 3)."""
        self._groups = _groups()
        # Views of what MuJoCo keeps in one place; asking it for them anew takes as long as using them.
        self._place, self._turn = self._data.xpos[self._body], self._data.xmat[self._body].reshape(3, 3)
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
        self._pyramid, self._number = bundle or (PyramidSlice(self._model, [known], self._groups, savings), 0)
        self._bodies = BodiesInReach(self._model, known, self._groups, cutoff, savings)
        if aims:
            self.aim(directions)

    @classmethod
    def of_turn(cls, mount: Mount, parts: Sequence[Array], *, cutoff: float) -> list[RayCaster]:
        """Return a caster for each part of a turn; asked in turns they cost less than casters each by itself.

        Args:
            mount: The link.
            parts: Unit vectors of each in the link's frame, shape (n, 3).
            cutoff: As of a caster.
        """
        room = RayBuffers.of(max(map(len, parts)))
        beside = PyramidSlice(mount.world.model, parts, _groups(), mount.world.savings)
        return [
            cls(mount, part, cutoff=cutoff, buffers=room, bundle=(beside, number))
            for number, part in enumerate(parts)
        ]

    def aim(self, directions: Array) -> None:
        """Take as many other directions, of a caster that `aims`."""
        self.own_directions[:] = directions
        self._pyramid.aim([self.own_directions])
        self._bodies.aim(self.own_directions)

    def cast(self) -> Array:
        """Return the distances, shape (n,) [m]; inf for no hit. A few may lie beyond the cutoff.

        They, and what else it found, stay so until the next cast.
        """
        place, turn = self._place, self._turn
        np.dot(self.own_directions, turn.T, out=self.directions)
        self._slice.look(place, turn)
        self._pyramid.look(self._number, place, turn)
        self._bodies.look(place, turn, self._data)
        with self._bounds, self._slice, self._pyramid, self._bodies:
            mujoco.mj_multiRay(
                self._model,
                self._data,
                place,
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
        (x, y, z), (to_x, to_y, to_z) = self.directions.T, self.normals.T
        cosines: Array = x * to_x
        cosines += z * to_z  # in the order of np.einsum, which takes twice as long for rows of three
        cosines += y * to_y
        return np.abs(cosines, out=cosines)


def _groups() -> NDArray[np.uint8]:
    """Return which groups of shapes rays see."""
    groups = np.zeros(mujoco.mjNGROUP, dtype=np.uint8)
    groups[[GROUP_SOLID, GROUP_COLLISION]] = 1
    return groups
