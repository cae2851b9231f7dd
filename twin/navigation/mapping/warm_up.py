"""Compile (or load from the disk cache) what SLAM runs, before the clock starts."""

from __future__ import annotations

import numpy as np

from twin.geometry import Pose2
from twin.navigation.ahead import ahead
from twin.navigation.mapping.slam import Slam, SlamConfig


@ahead
def warm_up() -> None:
    """Take two scans of a flat wall through every compiled function."""
    slam = Slam(SlamConfig(minimum_travel_distance=0.0))
    angles = np.linspace(-1.5, 1.5, 60)
    for step in range(2):
        slam.process(
            Pose2(0.1 * step, 0.0, 0.0), 1.0 / np.cos(0.5 * angles), angles, Pose2(0.0, 0.0, 0.0), step
        )
    slam.optimise()
    slam.map()
