"""docking_server drives up to a face or a tote as the scan sees it, and back off."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from tests.nodes.conftest import Bench
from tests.nodes.navigation.docking.dock import CONFIG, Dock
from twin.bridge.action_types import DockRobot, UndockRobot
from twin.bridge.msgs import GoalStatus, new
from twin.geometry import Pose2
from twin.nodes.messages import pose_stamped


def test_docking_corrects_a_wrong_belief_by_the_scan(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.03, 0.05))
    goal = dock.dock(believed=Pose2(2.08, 0.0, 0.06))
    assert goal.result.success
    pose = dock.robot.pose
    assert pose.x == pytest.approx(2.0 - 0.55, abs=0.015), "the distance is the scan's, not the map's"
    assert abs(pose.yaw) < math.radians(2.0), "and so is the heading"
    assert not dock.robot.joints.velocity.any()


def test_docking_at_a_tote_lines_up_with_it(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    dock.show_totes(0.06)
    assert dock.dock("tote").result.success
    assert dock.robot.pose.y == pytest.approx(0.06, abs=0.015)
    assert dock.robot.pose.x == pytest.approx(1.45, abs=0.015)


def test_a_wrong_first_sight_of_the_tote_is_corrected_on_the_way(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    goal = dock.send("tote")
    bench.run(0.1)
    dock.show_totes(0.0, first=0.12)
    bench.until(lambda: goal.done, 60.0)
    assert goal.result.success
    assert dock.robot.pose.y == pytest.approx(0.0, abs=0.015)


def test_a_tote_of_the_neighbouring_slot_is_not_the_one(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    dock.show_totes(0.5)
    goal = dock.dock("tote")
    assert (goal.result.success, goal.result.error_code) == (False, 904)
    assert goal.result.error_msg == "no box in sight"


@pytest.mark.parametrize("yaw", [0.0, 0.3, -0.3])
def test_of_two_totes_that_of_the_slot_counts_however_the_robot_is_turned(bench: Bench, yaw: float) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.08, yaw))
    dock.show_totes(-0.5, 0.02, 0.5)
    assert dock.dock("tote").result.success
    assert dock.robot.pose.y == pytest.approx(0.02, abs=0.01)
    assert abs(dock.robot.pose.yaw) < math.radians(1.0)


def test_a_dock_that_was_missed_is_approached_again_from_the_staging_distance(bench: Bench) -> None:
    """At the end the tote turns out to stand further aside: there is no way left to correct that."""
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    dock.show_totes(0.0)
    goal = dock.send("tote")
    bench.until(lambda: dock.robot.pose.x > 1.4, 60.0)
    bench.each_tick.pop()
    dock.show_totes(0.06)
    furthest_back = []
    bench.each_tick.append(lambda: furthest_back.append(dock.robot.pose.x))
    bench.until(lambda: goal.done, 60.0)
    assert (goal.result.success, goal.result.num_retries) == (True, 1)
    assert min(furthest_back) == pytest.approx(0.7, abs=0.03)
    assert dock.robot.pose.y == pytest.approx(0.06, abs=0.01)


def test_a_dock_that_is_not_there_is_not_docked_at(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0), shelf=False)
    goal = dock.dock()
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert (goal.result.error_code, goal.result.error_msg) == (904, "no face of the dock in sight")
    assert dock.robot.pose.x == pytest.approx(0.7)


def test_undocking_backs_off_straight_to_where_staging_is(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(1.45, 0.0, 0.0))
    assert dock.undock() == pytest.approx(0.75, abs=0.02)
    assert dock.robot.pose == pytest.approx((0.7, 0.0, 0.0), abs=0.02)
    assert max(v for v, _ in dock.robot.commands) <= 0.0
    assert not any(w for _, w in dock.robot.commands)


def test_undocking_after_no_docking_does_not_back_into_what_is_behind(bench: Bench) -> None:
    """No tote was in sight: the robot stands where it was staged and has no way to go back."""
    dock = Dock(bench, start=Pose2(0.72, 0.0, 0.0))
    assert not dock.dock("tote").result.success
    assert dock.undock() == pytest.approx(0.02, abs=0.02)


def test_a_cancelled_docking_stops(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(0.5, 0.0, 0.0))
    goal = dock.send()
    bench.run(1.5)
    assert dock.robot.joints.velocity.any()
    goal.cancel()
    bench.until(lambda: goal.done, 1.0)
    assert goal.status == GoalStatus.STATUS_CANCELED
    bench.run(0.5)
    assert not dock.robot.joints.velocity.any()


# What comes between


def driving(bench: Bench, x: float = 0.9, **changes: Any) -> tuple[Dock, Any]:
    """Return a robot on its way to the dock, which looks at a costmap, and its goal."""
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0), costmap=True, config=replace(CONFIG, **changes))
    goal = dock.send()
    bench.until(lambda: dock.robot.pose.x > x, 20.0)
    return dock, goal


def test_without_a_lidar_it_stands_and_says_why(bench: Bench) -> None:
    dock, goal = driving(bench)
    dock.robot.blind = True
    bench.run(0.6)
    stood = dock.robot.pose
    assert stood.x < 1.05
    bench.until(lambda: goal.done, 6.0)
    assert (goal.result.error_code, goal.result.num_retries) == (905, 0), "it could not drive back either"
    assert goal.result.error_msg.startswith("the local costmap is not current: no scan for 5.")
    assert dock.robot.pose.distance(stood) < 1e-6


def test_a_lidar_that_comes_back_delays_it_only(bench: Bench) -> None:
    dock, goal = driving(bench)
    dock.robot.blind = True
    bench.run(3.0)
    dock.robot.blind = False
    bench.until(lambda: goal.done, 30.0)
    assert (goal.result.success, goal.result.num_retries) == (True, 0)
    assert dock.robot.pose.x == pytest.approx(1.45, abs=0.015)


def test_it_waits_for_who_stands_before_the_dock(bench: Bench) -> None:
    dock, goal = driving(bench)
    room = dock.robot.room
    empty = room.segments
    room.add_box(1.2, -0.1, 1.25, 0.1)
    bench.run(3.0)
    assert dock.robot.pose.x < 1.0
    assert not dock.robot.joints.velocity.any()
    room.segments = empty
    bench.until(lambda: goal.done, 30.0)
    assert (goal.result.success, goal.result.num_retries) == (True, 0)
    assert dock.robot.pose.x == pytest.approx(1.45, abs=0.015)


def test_what_stays_before_the_dock_ends_it(bench: Bench) -> None:
    dock, goal = driving(bench, max_retries=0)
    dock.robot.room.add_box(1.2, -0.1, 1.25, 0.1)
    bench.until(lambda: goal.done, 10.0)
    assert goal.result.error_code == 905
    assert goal.result.error_msg.startswith("docking failed: something is in the way, 0.")
    assert dock.robot.pose.x < 1.0


def test_undocking_does_not_back_into_what_stands_behind(bench: Bench) -> None:
    dock = Dock(bench, start=Pose2(1.45, 0.0, 0.0), costmap=True)
    dock.robot.room.add_box(0.7, -0.2, 0.8, 0.2)
    bench.run(0.5)
    goal = dock.undock_client.send_goal(new(UndockRobot.Goal, dock_type="table"))
    bench.until(lambda: goal.done, 20.0)
    assert goal.result.error_code == 905
    assert "something is in the way" in goal.result.error_msg
    assert dock.robot.pose.x > 0.95 + 0.02


@pytest.mark.parametrize(
    "wrong",
    [
        {"use_dock_id": False, "dock_pose": pose_stamped(Pose2(math.nan, 0.0, 0.0), "map", 0)},
        {"use_dock_id": True, "dock_id": "home", "max_staging_time": math.inf},
    ],
    ids=["pose", "time"],
)
def test_what_is_no_number_is_rejected(bench: Bench, wrong: dict[str, Any]) -> None:
    dock = Dock(bench, start=Pose2(0.7, 0.0, 0.0))
    goal = dock.dock_client.send_goal(new(DockRobot.Goal, **wrong))
    bench.until(lambda: goal.done, 1.0)
    assert goal.accepted is False
