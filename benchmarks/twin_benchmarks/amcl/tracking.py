"""Tracking: the error of `map` → `base_footprint` while the robot drives from one random goal to the next."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import ns
from twin.bridge.topics import Sample
from twin.geometry import Array, Pose2
from twin.navigation.localisation.amcl import Amcl
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.warehouse.map_files import named_map
from twin_benchmarks.amcl.world import ROBOT, Bench, PoseError, error, opened

_SETTLED_NS = 5_000_000_000
"""The initial guess is 20 cm and 5 degrees off; the error counts from here on."""
_REMEMBERED_NS = 1_000_000_000


@dataclass(frozen=True, kw_only=True)
class Tracking:
    """Outcome."""

    distance_m: float
    simulated_s: float
    rms_m: float
    """Of the position."""
    max_m: float
    rms_deg: float
    max_deg: float
    nees: float
    """Mean of the normalised estimation error squared of `amcl_pose`; 3 is honest, less is modest."""
    real_time: float
    """Simulated seconds per CPU second of the whole run: physics, sensors, all nodes."""
    amcl_real_time: float
    """Simulated seconds per CPU second of the filter, on the same scans."""
    recoveries: int


@dataclass
class _Log:
    """What is heard on the bus, and the truth of the last second."""

    first: Pose2 | None = None
    truths: dict[int, Pose2] = field(default_factory=dict)
    nees: list[float] = field(default_factory=list)
    scans: list[tuple[int, Array]] = field(default_factory=list)

    def remember(self, time_ns: int, truth: Pose2) -> None:
        self.first = self.first or truth
        self.truths[time_ns] = truth
        self.truths.pop(time_ns - _REMEMBERED_NS, None)

    def on_sample(self, sample: Sample[Any]) -> None:
        if sample.topic == "/amcl_pose" and sample.time_ns > _SETTLED_NS:
            pose = sample.message.pose
            wrong = error(pose2_from_pose(pose.pose), self.truths[ns(sample.message.header.stamp)])
            covariance = pose.covariance.reshape(6, 6)[np.ix_([0, 1, 5], [0, 1, 5])]
            vector = np.array([wrong.x, wrong.y, wrong.yaw])
            self.nees.append(float(vector @ np.linalg.solve(covariance, vector)))
        elif sample.topic == "/scan":
            self.scans.append((sample.time_ns, sample.message.ranges))


def track(distance: float, seed: int, progress: Callable[[float, float], None] | None = None) -> Tracking:
    """Drive `distance` [m] and score.

    Args:
        distance: [m]
        seed: Of goals and noise.
        progress: Called with the metres driven and those to drive.
    """
    log = _Log()
    mission = {"type": "random_goals", "robot": ROBOT, "distance": 2.0 * distance, "max_failed": 1000}
    with opened(mission, seed, navigation=True, tap=log.on_sample) as bench:
        return _drive(bench, log, distance, progress)


def _drive(
    bench: Bench, log: _Log, distance: float, progress: Callable[[float, float], None] | None
) -> Tracking:
    errors: list[PoseError] = []
    odometry: dict[int, Pose2] = {}
    driven, last, cpu = 0.0, bench.truth, time.process_time()
    while driven < distance and not bench.run.over:
        now, truth = bench.now_ns, bench.truth
        log.remember(now, truth)
        driven, last = driven + last.distance(truth), truth
        wrong = bench.tick()
        odom = bench.stack.robot_pose.in_odom()
        if odom is not None and now % 100_000_000 == 0:
            odometry[now] = odom
        if wrong is not None and now > _SETTLED_NS:
            errors.append(wrong)
        if progress is not None and now % 1_000_000_000 == 0:
            progress(driven, distance)
    cpu = time.process_time() - cpu
    simulated = bench.now_ns * 1e-9
    xy, yaw = np.array([e.xy for e in errors]), np.degrees([e.yaw for e in errors])
    navigator = bench.stack.navigator
    return Tracking(
        distance_m=driven,
        simulated_s=simulated,
        rms_m=float(np.sqrt(np.mean(xy**2))),
        max_m=float(xy.max()),
        rms_deg=float(np.sqrt(np.mean(yaw**2))),
        max_deg=float(np.abs(yaw).max()),
        nees=float(np.mean(log.nees)),
        real_time=simulated / cpu,
        amcl_real_time=simulated / _filter_cost(bench, log, odometry),
        recoveries=0 if navigator is None else navigator.recoveries,
    )


def _filter_cost(bench: Bench, log: _Log, odometry: dict[int, Pose2]) -> float:
    """Return the CPU time [s] of the filter alone on the scans of the run."""
    lidar = next(sensor.spec for sensor in bench.stack.handle.sensors if sensor.spec.topic == "scan")
    T_base_lidar = bench.stack.robot_pose.relative(bench.stack.frames.base, lidar.link)
    assert T_base_lidar is not None
    amcl = Amcl(AmclConfig(), OccupancyMap.load(named_map("warehouse")), 0)
    assert log.first is not None
    amcl.initialise(log.first, np.diag([0.04, 0.04, 0.01]))
    angles = np.linspace(-math.radians(135.0), math.radians(135.0), len(log.scans[0][1]))
    start = time.process_time()
    for stamp, ranges in log.scans:
        if stamp in odometry:
            amcl.update(odometry[stamp], ranges, angles, T_base_lidar)
    return time.process_time() - start
