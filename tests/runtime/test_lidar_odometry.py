"""Odometry from clouds: a skid steer, whose wheels slip, knows by its lidar where it went."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from twin.bridge.conversions import pose3_from_pose
from twin.bridge.msgs import Odometry, ns
from twin.errors import CloudError, ScenarioError
from twin.geometry import Pose2, wrap_angle
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

ROBOT = {"model": "jackal", "args": {"velodyne": "true"}, "start": "start", "lidar_odometry": {}}
STEPS = [{"duration": 2.0, "linear": 1.0, "angular": 0.8}, {"duration": 2.0, "linear": 0.2, "angular": -1.5}]


def scenario_of(**robot: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "drift",
            "duration": 4.0,
            "world": {"arena": "warehouse"},
            "robots": [ROBOT | robot],
            "mission": {"type": "velocity_profile", "robot": "jackal", "steps": STEPS},
            "checks": [{"no_collision": {}}],
        }
    )


class Driven:
    """Drives, and compares what odometries told with where the robot was."""

    def __init__(self, make_run: Callable[..., Run], **robot: Any) -> None:
        run = make_run(scenario_of(**robot))
        self.heard: dict[str, list[Odometry]] = {"/odom": [], "/lidar_odometry": []}
        run.bus.tap(lambda sample: self.heard.get(sample.topic, []).append(sample.message))
        poses: list[tuple[float, ...]] = []
        while not run.over:
            run.tick()
            pose = run.world.pose("jackal/base_footprint").to_pose2()
            poses.append((run.world.time_ns, pose.x, pose.y, pose.yaw))
        self.truth = np.array(poses).T
        self.truth[3] = np.unwrap(self.truth[3])

    def true_pose(self, at_ns: int) -> Pose2:
        """Return where the robot was, also between two ticks."""
        x, y, yaw = (float(np.interp(at_ns, self.truth[0], row)) for row in self.truth[1:])
        return Pose2(x, y, yaw)

    def errors(self, topic: str) -> np.ndarray:
        """Return those of x, y, yaw since the first message, shape (n, 3)."""
        told = [(ns(m.header.stamp), pose3_from_pose(m.pose.pose).to_pose2()) for m in self.heard[topic]]
        start_ns, start = told[0]
        start_error = self.true_pose(start_ns) @ start.inverse()
        found = []
        for stamp_ns, pose in told:
            truth = start_error.inverse() @ self.true_pose(stamp_ns)
            found.append((pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.yaw - truth.yaw)))
        return np.array(found)


def test_clouds_tell_better_than_slipping_wheels_where_the_robot_went_and_how_sure_that_is(
    make_run: Callable[..., Run],
) -> None:
    driven = Driven(make_run)
    errors, wheels = driven.errors("/lidar_odometry"), driven.errors("/odom")
    heard = driven.heard["/lidar_odometry"]
    assert len(heard) >= 38
    # While the robot speeds up, points of one turn do not fit together; that passes.
    assert np.median(np.hypot(*errors[:, :2].T)) < 0.02
    assert np.median(abs(errors[:, 2])) < 0.01
    assert np.hypot(*errors[-1, :2]) < 0.03
    assert abs(errors[-1, 2]) < 0.01
    assert np.hypot(*errors[-1, :2]) < 0.5 * np.hypot(*wheels[-1, :2])
    assert (heard[0].header.frame_id, heard[0].child_frame_id) == ("odom_lidar", "base_footprint")
    squared = []
    for message, error in zip(heard[1:], errors[1:], strict=True):
        covariance = message.pose.covariance.reshape(6, 6)
        assert np.linalg.eigvalsh(covariance).min() > 0.0
        squared.append(error @ np.linalg.solve(covariance[np.ix_([0, 1, 5], [0, 1, 5])], error))
    assert 0.01 < np.median(squared) < 8.0
    speeds = [message.twist.twist.linear.x for message in heard[8:18]]
    assert np.median(speeds) == pytest.approx(1.0, abs=0.1)


def test_other_drivers_times_serve_as_well_and_two_runs_tell_the_same(make_run: Callable[..., Run]) -> None:
    one, two = (Driven(make_run, args={"livox": "mid360"}) for _ in range(2))
    assert [str(message) for message in one.heard["/lidar_odometry"]] == [
        str(message) for message in two.heard["/lidar_odometry"]
    ]
    errors = one.errors("/lidar_odometry")
    assert np.median(np.hypot(*errors[:, :2].T)) < 0.02  # 0.036 if taken as measured at once
    assert np.hypot(*errors[-1, :2]) < 0.03
    assert abs(errors[-1, 2]) < 0.01


def test_what_is_not_there_is_told_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        ScenarioError, match="'jackal' has no lidar that makes clouds; valid is one, or a topic"
    ):
        build(scenario_of(args={}))
    monkeypatch.setitem(sys.modules, "small_gicp", None)
    with pytest.raises(CloudError, match=r"needs small_gicp, .* pip install 'twin\[odometry\]'"):
        build(scenario_of())
