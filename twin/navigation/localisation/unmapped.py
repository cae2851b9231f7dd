"""Beams that end at things which are on no map: they hide the map, and do not speak against it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation.localisation.laser_scan import Beams
from twin.navigation.localisation.surface_distance import SurfaceDistance

_FAR_FROM_SURFACES = 0.3
"""A beam that ends nearer to a surface may have hit that [m]."""
_MOST = 0.6
"""A larger share of a scan than this is not taken for strangers: the robot may be somewhere else."""


def explained_share(shares: Array, beams: Beams, pose: Pose2, surfaces: SurfaceDistance) -> float:
    """Return how much of a scan, 0 … 1, the map explains, of what it could explain.

    A beam that ends in the open, before any wall, is one that a stranger stopped; one that ends behind a wall
    speaks against the pose.

    Args:
        shares: How well each beam fits, 0 … 1, shape (n,).
        beams: The scan.
        pose: Of the base in the map.
        surfaces: The map's.
    """
    strangers = stopped_short(beams, pose, surfaces)
    could = max(len(beams) - int(strangers.sum()), (1.0 - _MOST) * len(beams))
    return min(1.0, float(shares[~strangers].sum()) / could)


def stopped_short(beams: Beams, pose: Pose2, surfaces: SurfaceDistance) -> NDArray[np.bool_]:
    """Return which beams, shape (n,), end in the open and pass through no surface on their way."""
    start, ends = np.array((pose @ beams.origin)[:2]), pose.apply(beams.ends)
    open_ended: NDArray[np.bool_] = surfaces.at(ends) > _FAR_FROM_SURFACES
    for i in np.flatnonzero(open_ended):
        way = ends[i] - start
        steps = max(2, int(np.hypot(*way) / surfaces.resolution))
        points = start + np.linspace(0.0, 1.0, steps)[:, None] * way
        open_ended[i] = bool((surfaces.at(points) > 0.0).all())
    return open_ended
