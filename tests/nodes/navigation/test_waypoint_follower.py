"""The waypoint follower before a navigator that only pretends to drive."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

from tests.nodes.conftest import Bench
from twin.bridge.action_types import FollowWaypoints, NavigateToPose
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.msgs import GoalStatus, new
from twin.geometry import Pose2
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.waypoint_follower import (
    WaitAtWaypointConfig,
    WaypointFollowerConfig,
    WaypointFollowerNode,
)


class Course:
    """Waypoints at x = 0, 1, 2, …; the navigator cannot go to those in `walls`."""

    def __init__(self, bench: Bench, *walls: int, pause: int = 0, **config: Any) -> None:
        self.bench, self.walls = bench, walls
        self.visited: list[tuple[int, float]] = []
        self.cancelled = 0
        self.told: list[int] = []
        ActionServer(bench.bus.create_node("navigator"), NavigateToPose, "navigate_to_pose", self.drive)
        wait = WaitAtWaypointConfig(waypoint_pause_duration=pause)
        WaypointFollowerNode(bench.bus, WaypointFollowerConfig(wait_at_waypoint=wait, **config))
        self.client = ActionClient(bench.node, FollowWaypoints, "follow_waypoints")

    def drive(self, handle: GoalHandle) -> Generator[None, None, Any]:
        for _ in range(10):
            if handle.is_cancel_requested:
                self.cancelled += 1
                handle.canceled()
                return new(NavigateToPose.Result)
            yield
        x = round(handle.request.pose.pose.position.x)
        if x in self.walls:
            handle.abort()
            return new(NavigateToPose.Result, error_code=206, error_msg="a wall")
        self.visited.append((x, self.bench.now_s))
        return new(NavigateToPose.Result)

    def follow(self, count: int, **fields: Any) -> Any:
        poses = [pose_stamped(Pose2(float(x), 0.0, 0.0), "map", 0) for x in range(count)]
        goal = new(FollowWaypoints.Goal, poses=poses, **fields)
        return self.client.send_goal(goal, lambda message: self.told.append(int(message.current_waypoint)))

    def finish(self, sent: Any) -> Any:
        self.bench.until(lambda: sent.done, 20.0)
        return sent.result

    @property
    def order(self) -> list[int]:
        return [x for x, _ in self.visited]


def test_it_visits_one_after_the_other(bench: Bench) -> None:
    course = Course(bench)
    sent = course.follow(3)
    assert course.finish(sent).missed_waypoints == []
    assert sent.succeeded
    assert course.order == [0, 1, 2]
    assert sorted(set(course.told)) == [0, 1, 2]


@pytest.mark.parametrize(
    ("fields", "order"),
    [({"number_of_loops": 1}, [0, 1, 2, 0, 1, 2]), ({"goal_index": 2, "number_of_loops": 1}, [2, 0, 1, 2])],
)
def test_loops_and_the_first_waypoint(bench: Bench, fields: dict[str, int], order: list[int]) -> None:
    course = Course(bench)
    course.finish(course.follow(3, **fields))
    assert course.order == order


def test_it_goes_on_after_a_waypoint_that_is_missed(bench: Bench) -> None:
    course = Course(bench, 1, 2, stop_on_failure=False)
    sent = course.follow(4)
    result = course.finish(sent)
    assert sent.succeeded
    assert course.order == [0, 3]
    assert [(m.index, m.goal.pose.position.x, m.error_code) for m in result.missed_waypoints] == [
        (1, 1.0, 206),
        (2, 2.0, 206),
    ]


def test_or_stops_there(bench: Bench) -> None:
    course = Course(bench, 1)
    sent = course.follow(3)
    result = course.finish(sent)
    assert sent.status == GoalStatus.STATUS_ABORTED
    assert (result.error_code, result.error_msg) == (603, "waypoint 1 missed: a wall")
    assert [m.index for m in result.missed_waypoints] == [1]
    assert course.order == [0]


def test_it_waits_at_every_waypoint(bench: Bench) -> None:
    course = Course(bench, pause=2000)
    course.finish(course.follow(2))
    (_, first), (_, second) = course.visited
    assert second - first > 2.0
    assert bench.now_s - second >= 1.9, "at the last one too"


@pytest.mark.parametrize(("count", "first", "words"), [(0, 0, "no waypoints"), (2, 5, "waypoint 5 of 2")])
def test_nothing_to_follow(bench: Bench, count: int, first: int, words: str) -> None:
    course = Course(bench)
    result = course.finish(course.follow(count, goal_index=first))
    assert result.error_code == 602
    assert words in result.error_msg


def test_a_cancel_reaches_the_navigator(bench: Bench) -> None:
    course = Course(bench)
    sent = course.follow(3)
    bench.run(0.12)
    sent.cancel()
    course.finish(sent)
    assert sent.status == GoalStatus.STATUS_CANCELED
    bench.run(0.2)
    assert course.cancelled == 1
    assert course.order == []


def test_as_many_loops_as_a_message_can_hold(bench: Bench) -> None:
    course = Course(bench)
    sent = course.follow(2, number_of_loops=2**32 - 1)
    bench.until(lambda: len(course.visited) > 4, 20.0)
    assert course.order[:5] == [0, 1, 0, 1, 0]
    assert not sent.done
