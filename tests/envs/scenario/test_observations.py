"""Messages as arrays: what is where, in what unit, within what bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.envs.scenario.conftest import MakeEnv
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import LaserScan, OccupancyGrid, Odometry, PoseArray, Twist, header, new
from twin.envs.scenario.observations import Channel, Costmap, Field, Poses, Scan
from twin.envs.scenario.observations import Odometry as OdometryChannel
from twin.errors import GymError
from twin.geometry import Pose2

NOBODY: Any = None
"""Channels that look at nothing but the message need no episode."""


def standing(T_map_base: Pose2 | None) -> Any:
    """Return an episode of a robot that believes to be there."""
    frames = SimpleNamespace(base="base")
    pose = SimpleNamespace(frames=frames, relative=lambda target, source: T_map_base)
    return SimpleNamespace(stack=SimpleNamespace(robot_pose=pose))


def test_a_scan_is_ranges_with_numbers_for_what_has_none() -> None:
    ranges = np.array([1.0, np.inf, -np.inf, np.nan, 3.0, 2.0], np.float32)
    message = new(LaserScan, ranges=ranges, range_max=12.0)
    assert Scan("/scan").values(message, NOBODY).tolist() == [1.0, 12.0, 0.0, 12.0, 3.0, 2.0]
    assert Scan("/scan", beams=3).values(message, NOBODY).tolist() == [1.0, 0.0, 2.0], "the nearest counts"


def test_odometry_is_a_pose_and_a_velocity() -> None:
    message = new(Odometry)
    message.pose.pose = pose_from_pose2(Pose2(1.0, -2.0, 0.5))
    message.twist.twist = new(Twist)
    message.twist.twist.linear.x, message.twist.twist.angular.z = 0.3, -0.2
    values = OdometryChannel("odom").values(message, NOBODY)
    assert values == pytest.approx([1.0, -2.0, 0.5, 0.3, -0.2])


def test_poses_that_are_missing_are_zeros() -> None:
    message = new(PoseArray, poses=[pose_from_pose2(Pose2(1.0, 0.1, 0.2))])
    assert Poses("p", count=2).values(message, NOBODY) == pytest.approx([1.0, 0.1, 0.2, 0.0, 0.0, 0.0])


def grid() -> OccupancyGrid:
    """Return one of 1 m cells, 6 along x and 4 along y, that has a 100 at (4.5, 1.5) in `map`."""
    data = np.zeros((4, 6), np.int8)
    data[1, 4] = 100
    message = new(OccupancyGrid, header=header(0, "map"), data=data.ravel())
    message.info.resolution, message.info.width, message.info.height = 1.0, 6, 4
    return message


@pytest.mark.parametrize(
    ("robot", "cell"),
    [
        (Pose2(2.5, 1.5, 0.0), (4, 2)),  # two cells ahead
        (Pose2(4.5, 0.5, 0.0), (2, 3)),  # one cell to the left
        (Pose2(4.5, 0.5, math.pi / 2), (3, 2)),  # one ahead
        (Pose2(4.5, 3.5, math.pi), (2, 4)),  # two to the left
    ],
)
def test_a_costmap_is_a_window_that_turns_with_the_robot(robot: Pose2, cell: tuple[int, int]) -> None:
    window = Costmap("map", cells=5, resolution=1.0).values(grid(), standing(robot))
    assert np.argwhere(window == 100).tolist() == [list(cell)]


def test_beyond_a_costmap_nothing_is_known() -> None:
    window = Costmap("map", cells=5, resolution=1.0).values(grid(), standing(Pose2(0.5, 0.5, 0.0)))
    assert (window[:2] == -1).all(), "behind the robot"
    assert (window[:, :2] == -1).all(), "to its right"
    assert (window[2:, 2:] == 0).all()
    lost = Costmap("map", cells=5, resolution=1.0).values(grid(), standing(None))
    assert (lost == -1).all()


def test_a_field_is_any_number_of_a_message() -> None:
    message = new(LaserScan, ranges=np.array([1.0, 2.0, 3.0], np.float32), range_max=12.0)
    assert Field("/scan.range_max", 0.0, 20.0).values(message, NOBODY).tolist() == [12.0]
    assert Field("/scan.ranges", 0.0, 20.0, size=2).values(message, NOBODY).tolist() == [1.0, 2.0]
    assert Field("/scan.ranges", 0.0, 20.0, size=4).values(message, NOBODY).tolist() == [1.0, 2.0, 3.0, 0.0]
    for path in ("/scan.colour", "/scan.header", "/scan"):
        with pytest.raises(GymError, match=f"{path} is no number, or array of numbers, of .*LaserScan"):
            Field(path, 0.0, 1.0).values(message, NOBODY)
    with pytest.raises(GymError, match="valid are finite ones"):
        Field("/scan.range_max", 0.0, math.inf).space(NOBODY)


@pytest.mark.parametrize(
    "wrong", [lambda: Scan("/scan", beams=361), lambda: Scan("/scan", beams=0), lambda: Scan("/odom")]
)
def test_a_channel_that_does_not_fit_is_told(
    make: MakeEnv, small: Path, wrong: Callable[[], Channel]
) -> None:
    with pytest.raises(GymError, match=r"/scan has 360 beams|/odom is no lidar's of robot 'diff_bot'"):
        make(small, observe=[wrong()])


def test_what_is_seen_is_what_the_robots_nodes_hear(make: MakeEnv, small: Path) -> None:
    field = Field("/imu.linear_acceleration.z", 0.0, 20.0)
    window = Costmap("/local_costmap/costmap", cells=16)
    env = make(small, observe=["/scan.ranges", Scan("scan", beams=36), "amcl_pose", field, window][1:])
    observation, _ = env.reset()
    assert observation["amcl_pose"] == pytest.approx([-1.5, -1.0, 0.0], abs=0.1)
    for _ in range(10):
        observation = env.step(np.zeros(2))[0]
    assert observation["scan"][18] == pytest.approx(4.0, abs=0.6), "the wall ahead"
    assert observation["imu.linear_acceleration.z"] == pytest.approx([9.81], abs=0.3)
    assert observation["local_costmap/costmap"].max() > 80, "a wall is near"
    ages = dict(zip(("scan", "amcl_pose", "imu", "costmap"), observation["age"].tolist(), strict=True))
    assert 0.0 <= ages["scan"] <= 0.1 + 1e-6
    assert ages["amcl_pose"] > 0.3, "the robot stands: amcl says nothing new"
    assert env.observation_space.contains(observation)


def test_before_the_first_message_there_are_zeros_that_are_old(make: MakeEnv, small: Path) -> None:
    env = make(
        small,
        "tune",
        observe=["odom", "amcl_pose"],
        parameters={"planner_server:smoother.max_its": (20, 60)},
        ticks=1,
    )
    observation, _ = env.reset()
    assert observation["age"][1] == 10.0
    assert not observation["amcl_pose"].any()
