"""How near a mirror is to the truth of its robot: minutes of driving over a poor link, which is then cut.

The robot is `twin plant` in a process of its own, by other wheels and another clock than its model's, and
2 % of its messages are lost, the others late by 80 ms on both ways; its autonomy and mission run in the
mirror. What the mirror said is compared with what the plant wrote down of itself, once it is over.

python -m benchmarks.measures.live_accuracy --minutes 10
"""

from __future__ import annotations

import argparse
import bisect
import csv
import itertools
import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.cable import Cable
from tests.processes import free_endpoint, wait_for_listener
from twin.bridge.wire.session import SessionConfig
from twin.geometry import Pose2, wrap_angle
from twin.live.mirror.live_source import LiveSource
from twin.live.mirror.mirror import Mirror
from twin.live.mirror.robot import MirroredRobot
from twin.scenario.schema import load

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse_patrol.yaml"
OFFSET_S, DRIFT = 0.4, 50e-6
PERTURBED = (
    "wheel_radius=0.97,track=1.02,mass=1.1,friction=0.8,loss=2%,link_delay=80ms,"
    f"clock_offset={OFFSET_S}s,clock_drift={DRIFT * 1e6:g}ppm"
)
CUT_S, AFTER_S = 3.0, 30.0
MEETS_S = 30.0
"""So long after the mirror has begun it may be what it is while it has not met its robot."""
DRIVES = 0.004
"""A robot that goes so far in a tick [m] is driving when the link is cut."""
NEAR = (0.05, math.radians(2.0))
"""In step is who is so near [m, rad] to where the robot is measured."""

Said = list[tuple[int, Pose2]]
"""Poses, and of when by the robot's clock [ns]."""


class Watched:
    """What a mirror says, tick by tick."""

    def __init__(self, mirror: Mirror) -> None:
        self.mirror = mirror
        (self.robot,) = mirror.robots
        self.world = mirror.run.run.world
        self.now: Said = []
        self.measured: Said = []
        self.followed: Said = []
        self.offsets: list[tuple[float, float, float]] = []
        """When by this computer's clock, the robot's clock from ours, and the bound of it [s]."""
        self.corrections: list[tuple[float, float]] = []
        self.labels: list[tuple[float, str]] = []
        self.near: list[tuple[float, bool]] = []
        self.steps: list[tuple[float, float]] = []
        """How far the virtual robot went in each tick [m]."""

    def until(self, end_s: float) -> None:
        """Go on until a simulated time [s]."""
        before, correction = self.pose, self.robot.follower.correction
        resets, heard = self.robot.follower.resets, self.robot.difference

        def look() -> bool:
            nonlocal before, correction, resets, heard
            now_s, pose = self.world.time_ns * 1e-9, self.pose
            (status,) = self.mirror.statuses()
            self.labels.append((now_s, status.judgement.label))
            self.now.append((self.mirror.clock.now_ns, pose))
            self.steps.append((now_s, pose.distance(before)))
            before = pose
            follower = self.robot.follower
            if follower.resets == resets:
                self.corrections.append(corrected(self.robot, pose, correction))
            correction, resets = follower.correction, follower.resets
            difference = self.robot.difference
            if difference is not None and difference is not heard and status.physical is not None:
                heard = difference
                self.measured.append((difference.stamp_ns, status.physical))
                virtual = follower.virtual_at(difference.stamp_ns)
                if virtual is not None:
                    self.followed.append((difference.stamp_ns, virtual))
                near = difference.position < NEAR[0] and abs(difference.yaw) < NEAR[1]
                self.near.append((now_s, near))
            if status.clock_offset_s is not None and status.evidence.clock_bound_s is not None:
                bound_s = status.evidence.clock_bound_s
                self.offsets.append((time.time(), status.clock_offset_s, bound_s))
            return now_s >= end_s

        self.mirror.advance(look)

    @property
    def pose(self) -> Pose2:
        """Where the virtual robot is."""
        return self.world.pose(self.robot.stack.handle.base).to_pose2()


def corrected(robot: MirroredRobot, pose: Pose2, before: Pose2) -> tuple[float, float]:
    """Return how far and by how much a tick's correction moved the virtual robot [m, rad]."""
    driven = robot.follower.correction.inverse() @ pose
    was = before @ driven
    return pose.distance(was), abs(wrap_angle(pose.yaw - was.yaw))


def truths(file: Path) -> tuple[list[int], list[Pose2]]:
    """Return when and where the robot truly was."""
    stamps, poses = [], []
    with file.open() as rows:
        for row in csv.DictReader(rows):
            stamps.append(int(row["stamp_ns"]))
            poses.append(Pose2(float(row["x"]), float(row["y"]), float(row["yaw"])))
    return stamps, poses


def errors(said: Said, stamps: Sequence[int], poses: Sequence[Pose2]) -> tuple[list[float], list[float]]:
    """Return how far poses are from the truth of their time, between two rows of it [m, degrees]."""
    positions, yaws = [], []
    for stamp_ns, pose in said:
        i = bisect.bisect_left(stamps, stamp_ns)
        if not 0 < i < len(stamps):
            continue
        share = (stamp_ns - stamps[i - 1]) / (stamps[i] - stamps[i - 1])
        step = poses[i - 1].inverse() @ poses[i]
        true = poses[i - 1] @ Pose2(share * step.x, share * step.y, share * step.yaw)
        positions.append(pose.distance(true))
        yaws.append(math.degrees(abs(wrap_angle(pose.yaw - true.yaw))))
    return positions, yaws


def spread(values: Iterable[float], unit: str, scale: float = 1.0) -> str:
    """Return median, 95th percentile and largest of some numbers."""
    found = scale * np.array(list(values))
    middle, high = np.percentile(found, (50, 95))
    return f"median {middle:.1f}, 95 % {high:.1f}, largest {found.max():.1f} {unit}"


def measure(minutes: float) -> None:
    """Drive for so long, cut the link, and print what came of it."""
    endpoint = free_endpoint()
    with TemporaryDirectory() as folder:
        truth = Path(folder) / "truth.csv"
        words = ["plant", str(SCENARIO), "--listen", endpoint, "--truth", str(truth)]
        words += ["--set", "world.obstacles=[]", "--perturb", PERTURBED]
        started_s = time.time()
        with subprocess.Popen([sys.executable, "-m", "twin.cli", *words], stdout=subprocess.DEVNULL) as plant:
            try:
                wait_for_listener(endpoint)
                with closing(Cable(endpoint)) as cable:
                    watched, cut_ns, cut_s = drive(cable, minutes * 60.0)
            finally:
                plant.send_signal(signal.SIGINT)
        report(watched, *truths(truth), started_s, cut_ns, cut_s)


def drive(cable: Cable, seconds: float) -> tuple[Watched, int, float]:
    """Mirror the robot at the cable's other end; return when the cable was cut, by its clock and by ours."""
    network = SessionConfig(mode="client", connect=(cable.endpoint,), timeout_s=60.0)
    overrides = {"world.obstacles": "[]", "mission.max_failed": "100000", "mission.distance": "1000 km"}
    with Mirror(load(SCENARIO, overrides), LiveSource(network), autonomy="all") as mirror:
        watched = Watched(mirror)
        watched.until(MEETS_S)
        events = len(watched.robot.events)
        for said in (watched.now, watched.measured, watched.followed, watched.corrections):
            said.clear()
        watched.until(MEETS_S + seconds)
        while watched.steps[-1][1] < DRIVES:
            watched.until(watched.steps[-1][0] + 0.1)
        print(f"{seconds:g} s: {watched.robot.follower.resets} times put elsewhere at once")
        for event in list(watched.robot.events)[events:]:
            print(f"  told: {event.what}: {event.text}")
        cut_ns, cut_s = mirror.clock.now_ns, watched.world.time_ns * 1e-9
        cable.whole.clear()
        offsets, watched.offsets = watched.offsets, []  # what waits in a cut cable is late on one way
        watched.until(cut_s + CUT_S)
        cable.whole.set()
        watched.until(cut_s + CUT_S + AFTER_S)
        watched.offsets = offsets
        return watched, cut_ns, cut_s


def report(
    watched: Watched,
    stamps: list[int],
    poses: list[Pose2],
    started_s: float,
    cut_ns: int,
    cut_s: float,
) -> None:
    """Print how near it was, and what a cut link did."""

    def until_cut(said: Said) -> Said:
        return [each for each in said if each[0] < cut_ns]

    for what, said in (
        ("where the robot is measured, at its stamp", watched.measured),
        ("virtual robot at that stamp", watched.followed),
        ("virtual robot now", watched.now),
    ):
        positions, yaws = errors(until_cut(said), stamps, poses)
        print(f"{what} ({len(positions)}): {spread(positions, 'mm', 1e3)}; {spread(yaws, 'degrees')}")
    i = bisect.bisect_left(stamps, cut_ns)
    driven = sum(a.distance(b) for a, b in itertools.pairwise(poses[:i]))
    print(f"the robot drove {driven:.0f} m")
    tick_s = watched.mirror.run.run.parts.control_period_ns * 1e-9
    far, turned = (max(each) / tick_s for each in zip(*watched.corrections, strict=True))
    print(f"corrections: at most {far:.3f} m/s, {turned:.3f} rad/s, by a clock that may be slewed by 1 %")
    began_s = watched.offsets[0][0]
    for first_s, last_s in ((0.0, 30.0), (30.0, math.inf)):
        off = [
            abs(offset_s - OFFSET_S - DRIFT * (at_s - started_s))
            for at_s, offset_s, _ in watched.offsets
            if first_s <= at_s - began_s < last_s
        ]
        print(f"clock from {first_s:g} s on: off by {spread(off, 'ms', 1e3)}")
    print(f"known to {spread((bound_s for *_, bound_s in watched.offsets), 'ms', 1e3)}")
    degraded_s = next(at_s for at_s, label in watched.labels if at_s > cut_s and label != "twin")
    again_s = cut_s + CUT_S
    print(f"cut for {CUT_S:g} s: the label degrades after {degraded_s - cut_s:.2f} s")
    print(f"  the robot stands {stands(stamps, poses, cut_ns):.2f} s after the cut")
    near_s = next(at_s for at_s, near in watched.near if at_s > again_s and near)
    twin_s = next(at_s for at_s, label in watched.labels if at_s > again_s and label == "twin")
    print(f"  in step {near_s - again_s:.2f} s after the end of it, a twin after {twin_s - again_s:.2f} s")
    farthest = max(step for at_s, step in watched.steps if at_s > cut_s)
    print(f"  the virtual robot went at most {farthest * 1e3:.1f} mm in a tick")


def stands(stamps: list[int], poses: list[Pose2], since_ns: int) -> float:
    """Return how long after a time the robot went less than 1 mm in 0.1 s for the first time [s]."""
    i = bisect.bisect_left(stamps, since_ns)
    for k in range(i, len(stamps) - 5):
        if poses[k].distance(poses[k + 5]) < 1e-3 and abs(wrap_angle(poses[k].yaw - poses[k + 5].yaw)) < 2e-3:
            return (stamps[k] - since_ns) * 1e-9
    return math.inf


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    measure(parser.parse_args().minutes)
