"""How near a robot is to everything else: the truth, for checks."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.sim.compose import FLOOR

if TYPE_CHECKING:
    from twin.sim.world import World

FARTHEST = 5.0
"""What is farther away is not looked for [m]."""


class _Shapes(NamedTuple):
    """What a robot is measured against."""

    own: NDArray[np.intp]
    """Geoms of the robot."""
    radii: Array
    """Of spheres around these, shape (n, 1) [m]."""
    others: NDArray[np.intp]
    """Geoms of everything else."""
    low: Array
    """Corner of a box around each of these along the world's axes, shape (m, 3) [m]."""
    high: Array
    """Its opposite corner."""
    moving: NDArray[np.intp]
    """Which of the others move, so that their boxes do."""


class ClearanceMeter:
    """Finds the smallest distance between shapes that collide; MuJoCo measures only pairs that may be it."""

    def __init__(self, world: World) -> None:
        """Bind to a world."""
        model, data = self._model, self._data = world.model, world.data
        owners = [model.body(body).name.partition("/") for body in model.geom_bodyid]
        floor = model.geom(FLOOR).id
        solid = ((model.geom_contype | model.geom_conaffinity) != 0) & (np.arange(model.ngeom) != floor)
        of = np.array([owner if slash else "" for owner, slash, _ in owners])
        placed = model.body_mocapid[model.body_rootid] >= 0
        moves = ((model.body_weldid != 0) | placed)[model.geom_bodyid]
        axes = data.geom_xmat.reshape(-1, 3, 3)
        middle = data.geom_xpos + np.einsum("nij,nj->ni", axes, model.geom_aabb[:, :3])
        half = np.einsum("nij,nj->ni", np.abs(axes), model.geom_aabb[:, 3:])
        self._shapes: dict[str, _Shapes] = {}
        for robot in world.robots:
            own, others = np.flatnonzero(solid & (of == robot)), np.flatnonzero(solid & (of != robot))
            self._shapes[robot] = _Shapes(
                own=own,
                radii=model.geom_rbound[own, None],
                others=others,
                low=(middle - half)[others],
                high=(middle + half)[others],
                moving=np.flatnonzero(moves[others]),
            )
        self._nearest: dict[str, tuple[int, int]] = {}
        """Of each robot the pair that was nearest the last time."""

    def clearance(self, robot: str) -> float:
        """Return the distance of a robot's shapes from what is neither itself nor the floor [m].

        Negative where they overlap; `FARTHEST` if nothing is nearer.
        """
        own, radii, others, low, high, moving = self._shapes[robot]
        if not len(own):
            return FARTHEST
        positions = self._data.geom_xpos
        if len(moving):
            ids = others[moving]
            middle, half = positions[ids], self._model.geom_rbound[ids, None]
            low[moving], high[moving] = middle - half, middle + half
        # The pair that was nearest is near still; so few of the others are to be looked at one by one.
        nearest = self._distance(*self._nearest[robot]) if robot in self._nearest else FARTHEST
        centres = positions[own]
        least, most = (centres - radii).min(axis=0), (centres + radii).max(axis=0)
        near = np.flatnonzero(_apart(low, high, least, most) <= max(nearest, 0.0))
        bounds = _apart(low[near, None], high[near, None], centres, centres) - radii[:, 0]
        rows, columns = np.nonzero(bounds < nearest)
        pairs = zip(
            bounds[rows, columns].tolist(), own[columns].tolist(), others[near[rows]].tolist(), strict=True
        )
        for bound, one, other in sorted(pairs):
            if bound >= nearest:
                break
            distance = self._distance(one, other)
            if distance < nearest:
                nearest, self._nearest[robot] = distance, (one, other)
        return nearest

    def _distance(self, one: int, other: int) -> float:
        return mujoco.mj_geomDistance(self._model, self._data, one, other, FARTHEST, None)


def _apart(low: Array, high: Array, least: Array, most: Array) -> Array:
    """Return the distances between boxes and boxes along the same axes, all given by their corners [m]."""
    gaps = np.maximum(low - most, least - high)
    np.maximum(gaps, 0.0, out=gaps)
    distances: Array = np.sqrt(np.einsum("...i,...i->...", gaps, gaps))
    return distances
