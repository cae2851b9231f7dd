"""tote_detector finds totes in a palm scan, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench, Robot, Room, box, scan
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import (
    LaserScan,
    PoseArray,
)
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetBool
from twin.geometry import Pose2, wrap_angle
from twin.nodes.tote_detector import ToteDetectorNode


class Palm:
    """Palm scans of what stands before a robot at the origin; the lidar frame serves as the palm's."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.robot = Robot(bench, Room(box(-9, -9, 9, 9)))
        self.seen = bench.listen(PoseArray, "tote_poses")
        ToteDetectorNode(bench.bus, self.robot.pose_lookup)
        self._publisher = bench.node.create_publisher(LaserScan, "palm_scan", SENSOR_DATA)
        self.angles = np.radians(np.arange(-45.0, 45.25, 0.5))
        bench.run(0.2)
        self.enable(True)

    def enable(self, on: bool) -> None:
        assert self.bench.call(SetBool, "tote_detector/enable", SetBool.Request(data=on)).success

    def look(self, segments: np.ndarray, noise: float = 0.0) -> list[Pose2]:
        """Scan and return the totes that were detected."""
        del self.seen[:]
        room = Room(segments, angles=self.angles, max_range=4.0)
        ranges = room.ranges(self.robot.T_base_lidar)
        ranges += (
            np.random.Generator(np.random.Philox(key=1)).normal(0.0, noise, len(ranges)) if noise else 0.0
        )
        stamp = self.bench.clock.now_ns - TICK_NS
        self._publisher.publish(scan(ranges, self.angles, stamp, max_range=4.0))
        self.bench.run(0.1)
        assert all(message.header.frame_id == "base_footprint" for message in self.seen)
        return [pose2_from_pose(pose) for message in self.seen for pose in message.poses]


@pytest.fixture
def palm(bench: Bench) -> Palm:
    return Palm(bench)


def tote(pose: Pose2, width: float = 0.24, depth: float = 0.3) -> np.ndarray:
    """A box whose front face's centre is at `pose`, x into it."""
    segments = box(0.0, -width / 2, depth, width / 2)
    return pose.apply(segments.reshape(-1, 2)).reshape(-1, 2, 2)


@pytest.mark.parametrize("pose", [Pose2(0.7, 0.0, 0.0), Pose2(0.8, 0.1, 0.15), Pose2(0.6, -0.08, -0.2)])
def test_a_tote_is_found_where_it_stands(palm: Palm, pose: Pose2) -> None:
    (found,) = palm.look(tote(pose), noise=0.003)
    assert found.distance(pose) < 0.015
    assert abs(wrap_angle(found.yaw - pose.yaw)) < 0.06


@pytest.mark.parametrize(
    "segments",
    [
        tote(Pose2(0.7, 0.0, 0.0), width=0.40),
        tote(Pose2(0.7, 0.0, 0.0), width=0.12),
        tote(Pose2(1.9, 0.0, 0.0)),
        box(-9.0, -9.0, 9.0, 9.0),
    ],
    ids=["too wide", "too narrow", "too far", "nothing"],
)
def test_other_things_are_no_tote(palm: Palm, segments: np.ndarray) -> None:
    assert palm.look(segments) == []


def test_it_looks_only_while_it_is_asked_to(palm: Palm) -> None:
    palm.enable(False)
    assert palm.look(tote(Pose2(0.7, 0.0, 0.0))) == []
    palm.enable(True)
    assert len(palm.look(tote(Pose2(0.7, 0.0, 0.0)))) == 1


def test_of_two_totes_the_one_straight_ahead_comes_first(palm: Palm) -> None:
    both = np.concatenate([tote(Pose2(0.8, 0.35, 0.0)), tote(Pose2(0.8, 0.02, 0.0))])
    assert [pose.y for pose in palm.look(both)] == pytest.approx([0.02, 0.35], abs=0.015)
