"""How far odometry drifts over 50 m in the warehouse: that of wheels, of clouds, and of all in one filter.

`python -m benchmarks.measures.cloud_odometry` lets `jackal`, a skid steer with a lidar of 16 layers, drive
between random goals, once for each seed. It finds its way by its wheels and `/amcl`, so what is measured
steers nothing, and all odometries are of the same drive. A line for each seed and odometry has the error of
the last pose [m, % of the way, degrees] and the largest on the way [m], both seen from where the robot began.
At the end there are medians and maxima over the seeds, their ratio to those of the wheels, and the largest
ratio in one drive. The digest of each run is printed: with the same seed it is the same every time.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twin.bridge.conversions import pose3_from_pose
from twin.bridge.msgs import Odometry, ns
from twin.bridge.topics import Sample
from twin.geometry import Array, Pose2, wrap_angle
from twin.nodes.navigation.localisation.ekf import EkfNode
from twin.runtime.open_run import OpenRun
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.schema import Scenario

ROBOT = "jackal"
BESIDE = "/without_clouds"
"""Namespace of a second filter, which has the wheels and the IMU alone."""
WHEELS = "wheels"
TOPICS = {
    WHEELS: "/odom",
    "wheels, IMU": f"{BESIDE}/odometry/filtered",
    "clouds": "/lidar_odometry",
    "all three": "/odometry/filtered",
}
LONGEST_S = 1200.0
"""Simulated time after which a drive is given up [s]."""
_POSE = [True, True, False, False, False, True, *[False] * 9]
"""The filter takes x, y and yaw of the clouds, as in docs/ros/clouds.md."""


def scenario_of(distance: float, seed: int) -> Scenario:
    """Return a drive of at least `distance` [m]."""
    fused = {"odom1": {"topic": "lidar_odometry", "config": _POSE}}
    filters = {"publish_tf": False, "smooth_lagged_data": True, "history_length": 1.0, "sources": fused}
    robot = {
        "model": ROBOT,
        "args": {"velodyne": "true"},
        "start": "start",
        "lidar_odometry": {"lidar_odom_frame": "odom"},
        "odometry": {"type": "ekf", "parameters": filters},
        "localisation": {"type": "amcl", "map": "warehouse"},
        "navigation": {},
    }
    # Wheels that slip count more metres than there are: the drive ends by the truth.
    mission = {"type": "random_goals", "robot": ROBOT, "distance": 2.0 * distance, "max_failed": 1000}
    return Scenario.model_validate(
        {
            "name": "cloud_odometry",
            "seed": seed,
            "duration": LONGEST_S,
            "world": {"arena": "warehouse"},
            "robots": [robot],
            "mission": mission,
            "checks": [{"no_collision": {}}],
        }
    )


@dataclass(frozen=True, kw_only=True)
class Drift:
    """What an odometry was off by."""

    end_m: float
    end_deg: float
    worst_m: float
    """On the way."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One drive."""

    driven_m: float
    simulated_s: float
    digest: str
    collided: bool
    recoveries: int
    drifts: dict[str, Drift]
    """By odometry."""


class Log:
    """Where the robot was, and what odometries told."""

    def __init__(self) -> None:
        self.truth: list[tuple[int, float, float, float]] = []
        """Time [ns], x, y and yaw."""
        self.told: dict[str, list[tuple[int, Pose2]]] = {topic: [] for topic in TOPICS.values()}
        self.driven = 0.0
        """[m]"""

    def on_sample(self, sample: Sample[Any]) -> None:
        """Take a message of an odometry."""
        told = self.told.get(sample.topic)
        if told is not None:
            message: Odometry = sample.message
            told.append((ns(message.header.stamp), pose3_from_pose(message.pose.pose).to_pose2()))

    def remember(self, time_ns: int, pose: Pose2) -> None:
        """Take where the robot is."""
        if self.truth:
            self.driven += math.hypot(pose.x - self.truth[-1][1], pose.y - self.truth[-1][2])
        self.truth.append((time_ns, *pose))

    def drift(self, topic: str) -> Drift:
        """Return what an odometry was off by, seen from its first message."""
        times, poses = zip(*self.told[topic], strict=True)
        true = self._at(np.array(times))
        first_true, first = true[0].inverse(), poses[0].inverse()
        wrong = [(first_true @ a, first @ b) for a, b in zip(true, poses, strict=True)]
        off = [a.distance(b) for a, b in wrong]
        turned = wrap_angle(wrong[-1][1].yaw - wrong[-1][0].yaw)
        return Drift(end_m=off[-1], end_deg=math.degrees(abs(turned)), worst_m=max(off))

    def _at(self, times: Array) -> list[Pose2]:
        """Return where the robot was: a cloud may end between two ticks."""
        known, x, y, yaw = np.array(self.truth).T
        columns = (np.interp(times, known, column) for column in (x, y, np.unwrap(yaw)))
        return [Pose2(*row) for row in np.stack(list(columns), axis=1).tolist()]


def add_filter_without_clouds(stack: RobotStack) -> None:
    """Let a second filter run beside the robot's own, with all of its sources but the clouds."""
    assert stack.filter is not None
    config = stack.filter.config
    sources = {
        name: replace(source, topic=f"/{source.topic.lstrip('/')}")
        for name, source in config.sources.items()
        if name != "odom1"
    }
    EkfNode(stack.context.bus, replace(config, sources=sources), namespace=BESIDE)


def drive(distance: float, seed: int) -> Drive:
    """Drive so far [m]; return what odometries were off by."""
    log = Log()
    opened = OpenRun(scenario_of(distance, seed), record=False, taps=[log.on_sample])
    try:
        run = opened.run
        stack = run.parts.stacks[ROBOT]
        add_filter_without_clouds(stack)
        base = f"{ROBOT}/{stack.frames.base}"

        def watch() -> bool:
            log.remember(run.world.time_ns, run.world.pose(base).to_pose2())
            return log.driven >= distance

        watch()
        opened.advance(watch)
        assert stack.navigator is not None
        return Drive(
            driven_m=log.driven,
            simulated_s=run.world.time_ns * 1e-9,
            digest=opened.digest.finish(run.world.state_digest()),
            collided=not all(check.result().passed for check in run.checks),
            recoveries=stack.navigator.recoveries,
            drifts={name: log.drift(topic) for name, topic in TOPICS.items()},
        )
    finally:
        opened.close()


def lines(seed: int, one: Drive, took_s: float) -> list[str]:
    """Return what is printed of a drive."""
    what = f"{one.driven_m:.1f} m in {one.simulated_s:.0f} s, {one.recoveries} recoveries"
    what += ", collided" if one.collided else ""
    found = [f"seed {seed}: {what}, digest {one.digest[:12]}, {took_s:.0f} s"]
    for name, drift in one.drifts.items():
        share = drift.end_m / one.driven_m
        found.append(
            f"  {name:12} {drift.end_m:7.3f} m {share:7.2%} {drift.end_deg:6.2f}° "
            f"worst {drift.worst_m:6.3f} m"
        )
    return found


def summary(drives: list[Drive]) -> list[str]:
    """Return smallest, median and largest of all drives, and what they are of those of the wheels."""
    heads = ("smallest", "median", "largest")
    found = [
        f"{'':12}"
        + "".join(f"{head:>17}" for head in heads)
        + "  on the way   of the wheels': medians, worst"
    ]
    wheels = np.array([one.drifts[WHEELS].end_m for one in drives])
    for name in TOPICS:
        drifts = [one.drifts[name] for one in drives]
        ends, turns = np.array([d.end_m for d in drifts]), np.array([d.end_deg for d in drifts])
        cells = [f"{f(ends):.3f} m {f(turns):5.2f}°" for f in (np.min, np.median, np.max)]
        found.append(
            f"{name:12}"
            + "".join(f"{cell:>17}" for cell in cells)
            + f"{max(d.worst_m for d in drifts):10.3f} m"
            + f"{np.median(ends) / np.median(wheels):25.3f}{(ends / wheels).max():7.3f}"
        )
    return found


def main() -> None:
    """Print lines for each seed, and a table of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="drives (default: 10)")
    parser.add_argument("--first", type=int, default=1, help="seed of the first (default: 1)")
    parser.add_argument("--distance", type=float, default=50.0, help="of each [m] (default: 50)")
    options = parser.parse_args()
    drives = []
    for seed in range(options.first, options.first + options.seeds):
        began = time.perf_counter()
        drives.append(drive(options.distance, seed))
        for line in lines(seed, drives[-1], time.perf_counter() - began):
            sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
    for line in summary(drives):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()
