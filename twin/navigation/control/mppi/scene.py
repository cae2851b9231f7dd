"""What one command of MPPI is computed from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.navigation.control.footprint_cover import FootprintCover
from twin.navigation.control.mppi.kernels import F32
from twin.navigation.control.path_handler import LocalPath
from twin.navigation.costmaps.costmap import Costmap


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Positions are in metres from the costmap's corner."""

    start: F32
    """x, y, yaw, v, w."""
    path: F32
    """Shape (3, n)."""
    along: F32
    """Distance along it, shape (n) [m]."""
    valid: np.ndarray
    """Which of its poses are free, shape (n)."""
    local: LocalPath
    costmap: Costmap
    cover: FootprintCover
