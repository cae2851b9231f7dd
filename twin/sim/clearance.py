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
_AT_ONCE = 16
"""Shapes of the surroundings, nearest first."""


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

    def clearance(self, robot: str) -> float:
        """Return the distance of a robot's shapes from what is neither itself nor the floor [m].

        Negative where they overlap; `FARTHEST` if nothing is nearer.
        """
        own, others = self._pairs[robot]
        # A sphere around the whole robot leaves few of the hall's shapes to be looked at one by one.
        centres, radii = self._data.geom_xpos[own], self._model.geom_rbound[own]
        middle = centres.mean(axis=0)
        reach = np.max(np.linalg.norm(centres - middle, axis=1) + radii)
        around = self._at_least(middle[None], np.array([reach]), others)[0]
        order = np.argsort(around, kind="stable")
        nearest = FARTHEST
        for begin in range(0, len(order), _AT_ONCE):
            some = order[begin : begin + _AT_ONCE]
            if around[some[0]] >= nearest:
                break
            least = self._at_least(centres, radii, others[some])
            for pair in np.argsort(least, axis=None, kind="stable"):
                i, j = divmod(int(pair), len(some))
                if least[i, j] >= nearest:
                    break
                shapes = int(own[i]), int(others[some[j]])
                distance = mujoco.mj_geomDistance(self._model, self._data, *shapes, nearest, None)
                nearest = min(nearest, distance)
        return float(nearest)

    def _at_least(self, centres: Array, radii: Array, others: NDArray[np.intp]) -> Array:
        """Return lower bounds of the distances of spheres, shapes (n, 3) and (n,), from the boxes of shapes.

        Shape (n, m) [m].
        """
        model, data = self._model, self._data
        offsets = centres[:, None] - data.geom_xpos[others]
        local = np.einsum("nmi,mij->nmj", offsets, data.geom_xmat[others].reshape(-1, 3, 3))
        boxes = model.geom_aabb[others]
        outside = np.maximum(np.abs(local - boxes[:, :3]) - boxes[:, 3:], 0.0)
        bounds: Array = np.sqrt(np.einsum("nmi,nmi->nm", outside, outside)) - radii[:, None]
        return bounds
