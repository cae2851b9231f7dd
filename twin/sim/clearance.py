"""How near a robot is to everything else: the truth, for checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.sim.compose import FLOOR

if TYPE_CHECKING:
    from twin.sim.world import World

FARTHEST = 5.0
"""What is farther away is not looked for [m]."""


class ClearanceMeter:
    """Finds the smallest distance between shapes that collide; MuJoCo measures only pairs that may be it."""

    def __init__(self, world: World) -> None:
        """Bind to a world."""
        model = self._model = world.model
        self._data = world.data
        owners = [model.body(body).name.partition("/") for body in model.geom_bodyid]
        floor = model.geom(FLOOR).id
        solid = ((model.geom_contype | model.geom_conaffinity) != 0) & (np.arange(model.ngeom) != floor)
        of = np.array([owner if slash else "" for owner, slash, _ in owners])
        self._pairs = {
            robot: (np.flatnonzero(solid & (of == robot)), np.flatnonzero(solid & (of != robot)))
            for robot in world.robots
        }
        self._nearest: dict[str, tuple[int, int]] = {}

    def clearance(self, robot: str) -> float:
        """Return the distance of a robot's shapes from what is neither itself nor the floor [m].

        Negative where they overlap; `FARTHEST` if nothing is nearer.
        """
        own, others = self._pairs[robot]
        # The pair that was nearest is near still; so few of the others are to be looked at one by one.
        nearest = self._distance(*self._nearest[robot]) if robot in self._nearest else FARTHEST
        centres, radii = self._data.geom_xpos[own], self._model.geom_rbound[own]
        middle = centres.sum(axis=0) / max(len(own), 1)
        offsets = centres - middle
        reach = np.max(np.sqrt(np.einsum("ni,ni->n", offsets, offsets)) + radii, initial=0.0, keepdims=True)
        some = others[self._at_least(middle, reach, others)[:, 0] < nearest]
        least = self._at_least(centres, radii, some)
        rows, columns = np.nonzero(least < nearest)
        pairs = zip(least[rows, columns].tolist(), own[columns].tolist(), some[rows].tolist(), strict=True)
        for bound, one, other in sorted(pairs):
            if bound >= nearest:
                break
            distance = self._distance(one, other)
            if distance < nearest:
                nearest, self._nearest[robot] = distance, (one, other)
        return nearest

    def _distance(self, one: int, other: int) -> float:
        return mujoco.mj_geomDistance(self._model, self._data, one, other, FARTHEST, None)

    def _at_least(self, centres: Array, radii: Array, others: NDArray[np.intp]) -> Array:
        """Return lower bounds of the distances of spheres, shapes (n, 3) and (n,), from the boxes of shapes.

        Shape (m, n) [m].
        """
        model, data = self._model, self._data
        boxes = model.geom_aabb[others, None]
        outside = (centres - data.geom_xpos[others, None]) @ data.geom_xmat[others].reshape(-1, 3, 3)
        outside -= boxes[..., :3]
        np.abs(outside, out=outside)
        outside -= boxes[..., 3:]
        np.maximum(outside, 0.0, out=outside)
        bounds: Array = np.sqrt(np.einsum("mni,mni->mn", outside, outside)) - radii
        return bounds
