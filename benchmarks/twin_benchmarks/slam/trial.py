"""One log through SLAM: its errors, and how long it took."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.mapping.slam import Slam, SlamConfig
from twin_benchmarks.slam.log import SlamLog
from twin_benchmarks.slam.relations import RelationErrors, Relations, errors

TRANSLATION_BAR = 0.07
"""Mean error of translation that passes [m]; the references are good to 0.05 to 0.07 m."""
ROTATION_BAR = 1.0
"""Mean error of rotation that passes [deg]."""
SPEED_BAR = 10.0
"""How many times faster than the robot drove."""
LIDAR = Pose2(0.0, 0.0, 0.0)
"""The poses of these logs are those of the lidar."""

CONFIG = SlamConfig(minimum_travel_distance=0.3, minimum_travel_heading=0.3)
"""Scans of a handheld or fast turning lidar differ more than those of the parameters' robot."""


@dataclass(frozen=True, kw_only=True)
class SlamTrial:
    """What came of one log."""

    log: str
    scans: int
    length: float
    """[m]"""
    relations: int
    slam: RelationErrors
    odometry: RelationErrors
    """Of the wheels' odometry alone."""
    loops: int
    """Places seen again."""
    seconds: float
    """That it took [s]."""
    real_time: float
    """How many times faster than the robot drove."""
    timed: bool
    """Whether the log tells how long the drive took; otherwise 1 m/s is taken."""

    @property
    def passed(self) -> bool:
        """Whether it is within the bars."""
        return (
            self.slam.translation_mean <= TRANSLATION_BAR
            and self.slam.rotation_mean <= ROTATION_BAR
            and self.real_time >= SPEED_BAR
        )

    def to_dict(self) -> dict[str, Any]:
        """Return everything, for JSON."""
        return {**asdict(self), "passed": self.passed}


def run_log(
    log: SlamLog, relations: Relations, show: Callable[[int], None] = lambda scans: None
) -> tuple[SlamTrial, Slam]:
    """Map a log.

    Args:
        log: Scans and odometry; its reference is not looked at.
        relations: To score by.
        show: Called after every scan with the number of scans done.
    """
    _feed(Slam(CONFIG), log, min(len(log.ranges), 15), lambda scans: None)  # compiles what is to be timed
    slam = Slam(CONFIG)
    start = time.perf_counter()
    poses = _feed(slam, log, len(log.ranges), show)
    seconds = time.perf_counter() - start
    trial = SlamTrial(
        log=log.name,
        scans=len(log.ranges),
        length=log.length,
        relations=len(relations.first),
        slam=errors(relations, poses),
        odometry=errors(relations, log.odometry),
        loops=slam.loops_closed,
        seconds=seconds,
        real_time=log.duration / seconds,
        timed=log.timed,
    )
    return trial, slam


def _feed(slam: Slam, log: SlamLog, scans: int, show: Callable[[int], None]) -> Array:
    """Map the first `scans` of a log; return their poses, shape (scans, 3), as they are at the end."""
    nodes: list[tuple[int, Pose2]] = []
    for scan in range(scans):
        x, y, yaw = log.odometry[scan].tolist()
        odom, ranges = Pose2(x, y, yaw), log.ranges[scan]
        update = slam.process(odom, ranges, log.angles, LIDAR, scan)
        if update is None:
            nodes.append(slam.locate(odom, ranges, log.angles, LIDAR))
        else:
            nodes.append((update.node, Pose2(0.0, 0.0, 0.0)))
        show(scan + 1)
    poses = [Pose2(x, y, yaw) for x, y, yaw in slam.graph().poses.tolist()]
    return np.array([poses[node] @ relative for node, relative in nodes])
