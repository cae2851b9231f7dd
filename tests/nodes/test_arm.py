"""The arm's trajectory controller and the gripper, on joints that move, stick or hit something."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import TICK_S, Bench, Joints
from twin.bridge.action_types import FollowJointTrajectory, GripperCommand
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import (
    GoalStatus,
    GripperCommandMsg,
    JointTrajectory,
    JointTrajectoryPoint,
    duration,
    header,
    new,
)
from twin.nodes.gripper_controller import GripperControllerNode
from twin.nodes.joint_trajectory_controller import JointTrajectoryControllerNode


class Arm:
    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.joints = Joints(others=("lift", "extension", "finger"))
        bench.each_tick.append(self.joints.advance)
        JointTrajectoryControllerNode(bench.bus, self.joints, ("lift", "extension"))
        GripperControllerNode(bench.bus, self.joints, "finger")
        name = "arm_controller/follow_joint_trajectory"
        self.trajectory = ActionClient(bench.node, FollowJointTrajectory, name)
        self.gripper = ActionClient(bench.node, GripperCommand, "gripper_controller/gripper_cmd")

    def move(self, names: tuple[str, ...], *points: tuple[float, tuple[float, ...]]) -> Any:
        """Send a trajectory of (time [s], positions)."""
        messages = [
            new(JointTrajectoryPoint, positions=np.array(p), time_from_start=duration(round(t * 1e9)))
            for t, p in points
        ]
        trajectory = JointTrajectory(header=header(0, ""), joint_names=list(names), points=messages)
        return self.trajectory.send_goal(new(FollowJointTrajectory.Goal, trajectory=trajectory))

    def grip(self, position: float, max_effort: float = 10.0) -> Any:
        command = new(GripperCommandMsg, position=position, max_effort=max_effort)
        return self.gripper.send_goal(new(GripperCommand.Goal, command=command))

    def ended(self, goal: Any, seconds: float = 10.0) -> Any:
        self.bench.until(lambda: goal.done, seconds)
        return goal.result


@pytest.fixture
def arm(bench: Bench) -> Arm:
    return Arm(bench)


def test_it_goes_through_the_way_points_at_their_times(bench: Bench, arm: Arm) -> None:
    goal = arm.move(("lift", "extension"), (1.0, (0.2, 0.1)), (2.0, (0.4, 0.0)))
    bench.run(1.0)
    assert arm.joints.position[:2] == pytest.approx([0.2, 0.1], abs=0.02)
    result = arm.ended(goal)
    assert goal.succeeded
    assert result.error_code == 0
    assert bench.now_s == pytest.approx(2.0, abs=0.15)
    assert arm.joints.position[:2] == pytest.approx([0.4, 0.0], abs=0.005)


def test_it_never_jumps(bench: Bench, arm: Arm) -> None:
    arm.joints.speed = math.inf
    arm.joints.position[0] = arm.joints.target[0] = 0.3
    goal = arm.move(("lift",), (1.0, (0.0,)))
    fastest = 0.0
    while not goal.done:
        bench.tick()
        fastest = max(fastest, abs(arm.joints.velocity[0]))
    assert fastest < 1.5 * 0.3 / 1.0 + 0.01, "a cubic from rest to rest peaks at 1.5 times the mean speed"


def test_an_unknown_joint_is_named_in_the_result(arm: Arm) -> None:
    goal = arm.move(("lift", "elbow"), (1.0, (0.2, 0.1)))
    result = arm.ended(goal)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert result.error_code == FollowJointTrajectory.Result.INVALID_JOINTS
    assert "elbow" in result.error_string
    assert "extension" in result.error_string, "the message says what there is"


@pytest.mark.parametrize(
    "points",
    [(), ((1.0, (0.2,)),), ((1.0, (0.2, 0.1, 0.3)),), ((1.0, (math.nan, 0.0)),)],
    ids=["none", "too few", "too many", "nan"],
)
def test_a_malformed_goal_is_refused_and_nothing_moves(bench: Bench, arm: Arm, points: Any) -> None:
    goal = arm.move(("lift", "extension"), *points)
    result = arm.ended(goal)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert result.error_code == FollowJointTrajectory.Result.INVALID_GOAL
    assert result.error_string
    bench.run(0.5)
    assert not arm.joints.target.any()


def test_a_blocked_joint_is_named_with_its_error(bench: Bench, arm: Arm) -> None:
    arm.joints.position[:2] = arm.joints.target[:2] = 0.5
    arm.joints.blocked["lift"] = 0.3
    goal = arm.move(("lift", "extension"), (1.0, (0.1, 0.1)))
    result = arm.ended(goal)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert result.error_code == FollowJointTrajectory.Result.GOAL_TOLERANCE_VIOLATED
    assert "'lift' is +0.2" in result.error_string
    assert bench.now_s == pytest.approx(3.0, abs=0.2), "it waits for the goal time tolerance of 2 s"


def test_a_cancelled_move_stops_where_it_is(bench: Bench, arm: Arm) -> None:
    goal = arm.move(("lift",), (2.0, (0.4,)))
    bench.run(1.0)
    goal.cancel()
    arm.ended(goal)
    assert goal.status == GoalStatus.STATUS_CANCELED
    stopped = arm.joints.position[0]
    bench.run(1.0)
    assert arm.joints.position[0] == pytest.approx(stopped, abs=0.02)
    assert 0.1 < stopped < 0.3


def said(
    arm: Arm, names: tuple[str, ...], *points: tuple[float, tuple[float, ...], tuple[float, ...]]
) -> None:
    """Say a trajectory of (time [s], positions, velocities) on the topic."""
    publisher = arm.bench.node.create_publisher(JointTrajectory, "arm_controller/joint_trajectory")
    messages = [
        new(
            JointTrajectoryPoint,
            positions=np.array(p),
            velocities=np.array(v),
            time_from_start=duration(round(t * 1e9)),
        )
        for t, p, v in points
    ]
    publisher.publish(JointTrajectory(header=header(0, ""), joint_names=list(names), points=messages))


def test_messages_follow_one_another_without_a_stop(bench: Bench, arm: Arm) -> None:
    """As from somebody who decides ten times a second."""
    speeds = []
    for i in range(1, 11):
        said(arm, ("lift",), (0.1, (0.03 * i,), (0.3,)))
        bench.run(0.1)
        speeds.append(abs(arm.joints.velocity[0]))
    assert arm.joints.position[0] == pytest.approx(0.3, abs=0.03)
    assert min(speeds[2:]) > 0.2, "it is as fast between two messages as it was told"
    bench.run(0.5)
    assert arm.joints.velocity[0] == 0.0, "nobody says anything more"


def test_a_message_takes_the_place_of_a_goal_and_a_goal_that_of_a_message(bench: Bench, arm: Arm) -> None:
    goal = arm.move(("lift",), (2.0, (0.4,)))
    bench.run(0.5)
    said(arm, ("lift",), (3.0, (0.0,), ()))
    result = arm.ended(goal)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert result.error_string == "another trajectory has taken its place"
    bench.run(0.1)
    assert arm.ended(arm.move(("lift",), (1.0, (0.5,)))).error_code == 0
    bench.run(3.0)
    assert arm.joints.position[0] == pytest.approx(0.5, abs=0.005), "what the message said is over"


@pytest.mark.parametrize(
    ("names", "point"),
    [
        (("elbow",), (1.0, (0.2,), ())),
        (("lift",), (1.0, (0.2,), (0.1, 0.1))),
        (("lift",), (1.0, (0.2,), (math.inf,))),
        (("lift",), (1.0, (math.nan,), ())),
    ],
)
def test_a_message_that_cannot_be_followed_moves_nothing(
    bench: Bench, arm: Arm, names: tuple[str, ...], point: Any, caplog: pytest.LogCaptureFixture
) -> None:
    said(arm, names, point)
    bench.run(0.5)
    assert not arm.joints.target.any()
    assert "joint_trajectory refused: " in caplog.text


def test_gripper_reaches_its_goal_in_the_open(arm: Arm) -> None:
    goal = arm.grip(0.1)
    result = arm.ended(goal)
    assert goal.succeeded
    assert (result.reached_goal, result.stalled) == (True, False)
    assert result.position == pytest.approx(0.1, abs=0.003)


def test_gripper_stalls_on_something(arm: Arm) -> None:
    arm.joints.position[2] = arm.joints.target[2] = 0.15
    arm.joints.blocked["finger"] = 0.12
    goal = arm.grip(0.0)
    result = arm.ended(goal)
    assert goal.succeeded, "a stall is how a grasp succeeds"
    assert (result.reached_goal, result.stalled) == (False, True)
    assert result.position == pytest.approx(0.12)
    assert arm.joints.target[2] == 0.0, "and it goes on squeezing"


@pytest.mark.parametrize(("max_effort", "limit"), [(40.0, 40.0), (0.0, math.inf), (-1.0, math.inf)])
def test_gripper_presses_with_no_more_than_max_effort_if_there_is_one(
    arm: Arm, max_effort: float, limit: float
) -> None:
    arm.joints.blocked["finger"] = 0.12
    result = arm.ended(arm.grip(0.0, max_effort))
    assert arm.joints.strongest["finger"] == limit
    assert result.effort == limit, "the effort exerted, whichever way the finger presses"


def test_gripper_cancelled_stays_where_it_is(bench: Bench, arm: Arm) -> None:
    arm.joints.speed = 0.1
    goal = arm.grip(0.2)
    bench.run(0.5)
    goal.cancel()
    result = arm.ended(goal)
    assert goal.status == GoalStatus.STATUS_CANCELED
    assert not result.reached_goal
    assert arm.joints.target[2] == pytest.approx(result.position)
    assert bench.now_s < 0.5 + 5 * TICK_S
