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

    def clearance(self, robot: str) -> float:
        """Return the distance of a robot's shapes from what is neither itself nor the floor [m].

        Negative where they overlap; `FARTHEST` if nothing is nearer.
        """
        own, others = self._pairs[robot]
        least = self._at_least(own, others)
        nearest = FARTHEST
        for pair in np.argsort(least, axis=None, kind="stable"):
            i, j = divmod(int(pair), len(others))
            if least[i, j] >= nearest:
                break
            distance = mujoco.mj_geomDistance(
                self._model, self._data, int(own[i]), int(others[j]), nearest, None
            )
            nearest = min(nearest, distance)
        return float(nearest)

    def _at_least(self, own: NDArray[np.intp], others: NDArray[np.intp]) -> Array:
        """Return lower bounds of the distances of pairs, shape (n, m) [m]: spheres around, boxes around."""
        model, data = self._model, self._data
        centres, radii = data.geom_xpos[own], model.geom_rbound[own]
        offsets = centres[:, None] - data.geom_xpos[others]
        local = np.einsum("nmi,mij->nmj", offsets, data.geom_xmat[others].reshape(-1, 3, 3))
        boxes = model.geom_aabb[others]
        outside = np.maximum(np.abs(local - boxes[:, :3]) - boxes[:, 3:], 0.0)
        bounds: Array = np.sqrt(np.einsum("nmi,nmi->nm", outside, outside)) - radii[:, None]
        return bounds
