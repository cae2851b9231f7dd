"""`/explore`: sends goals to frontiers until none is left, pauses, gives up what fails, drives home."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.nodes.conftest import ORIGIN, Bench, Robot, open_room
from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Bool, ExploreStatus, MarkerArray, OccupancyGrid, new
from twin.bridge.qos import LATCHED
from twin.geometry import Pose2
from twin.navigation.exploration.config import ExplorerConfig, FrontierConfig
from twin.nodes.missions.simple import ExploreMissionNode
from twin.nodes.navigation.exploration.config import ExplorerNodeConfig
from twin.nodes.navigation.exploration.explorer import ExplorerNode
from twin.nodes.navigation.mapping.map_server import grid_msg


class Navigator:
    """Takes a second for a goal, or gives it up."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.goals: list[Pose2] = []
        self.cancelled = 0
        self.fails = False
        ActionServer(bench.node, NavigateToPose, "navigate_to_pose", self._execute)

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        self.goals.append(pose2_from_pose(handle.request.pose.pose))
        start = self.bench.now_s
        while self.bench.now_s < start + 1.0:
            if handle.is_cancel_requested:
                self.cancelled += 1
                handle.canceled()
                return new(NavigateToPose.Result)
            yield
        if self.fails:
            handle.abort()
            return new(NavigateToPose.Result, error_code=1, error_msg="no way")
        return new(NavigateToPose.Result)


class Place:
    """A corridor along x about the origin, known from -2 m to 2 m; `end` closes an end."""

    def __init__(self, bench: Bench, **config: Any) -> None:
        self.bench = bench
        self.data = np.full((40, 120), -1, dtype=np.int8)
        self.data[10, 20:100] = self.data[30, 20:100] = 100
        self.data[11:30, 20:100] = 0
        robot = Robot(bench, open_room(), start=ORIGIN)
        self.navigator = Navigator(bench)
        frontiers = FrontierConfig(robot_radius=0.2, inscribed_radius=0.2)
        settings = ExplorerNodeConfig(
            **{"explorer": ExplorerConfig(frontiers=frontiers, same_place=1.0), **config}
        )
        self.node = ExplorerNode(bench.bus, robot.pose_lookup, settings)
        self.mission = ExploreMissionNode(bench.bus, self.node)
        self._publisher = bench.node.create_publisher(OccupancyGrid, "/map", LATCHED)
        bench.each_tick.append(self._publish)

    def end(self, column: int) -> None:
        self.data[11:30, column] = 100

    def _publish(self) -> None:
        now = self.bench.clock.now_ns
        if now % 500_000_000 == 0:
            self._publisher.publish(grid_msg(self.data, 0.05, Pose2(-3.0, -1.0, 0.0), "map", now))


def statuses(bench: Bench) -> list[str]:
    got: list[str] = []
    bench.node.create_subscription(ExploreStatus, "/explore/status", lambda m: got.append(m.status), LATCHED)
    return got


def test_a_goal_looks_at_a_frontier_and_the_next_follows_when_it_is_known(bench: Bench) -> None:
    place, told = Place(bench), statuses(bench)
    bench.until(lambda: place.navigator.goals, 5.0)
    goal = place.navigator.goals[0]
    assert abs(goal.x) > 1.0
    assert np.cos(goal.yaw) * goal.x > 0.0
    place.end(19 if goal.x < 0.0 else 100)
    bench.until(lambda: len(place.navigator.goals) > 1, 5.0)
    assert place.navigator.goals[1].x * goal.x < 0.0
    place.end(100 if goal.x < 0.0 else 19)
    bench.until(lambda: place.mission.done, 5.0)
    bench.tick()
    assert place.mission.succeeded
    assert told == ["exploration_started", "exploration_complete"]
    assert place.node.explorer.given_up == []


def test_places_that_cannot_be_reached_are_given_up_and_the_mission_says_so(bench: Bench) -> None:
    place = Place(bench)
    place.navigator.fails = True
    bench.until(lambda: place.mission.done, 30.0)
    assert not place.mission.succeeded
    assert "no way" in place.mission.reason
    assert len(place.node.explorer.given_up) >= 2


def test_it_drives_back_at_the_end_if_it_is_to(bench: Bench) -> None:
    place, told = Place(bench, return_to_init=True), statuses(bench)
    bench.until(lambda: place.navigator.goals, 5.0)
    place.end(19)
    place.end(100)
    bench.until(lambda: place.mission.done, 10.0)
    bench.tick()
    assert place.mission.succeeded
    assert told[1:] == ["returning_to_origin", "returned_to_origin"]
    assert place.navigator.goals[-1].distance(ORIGIN) < 0.01


def test_it_pauses_and_resumes(bench: Bench) -> None:
    place, told = Place(bench), statuses(bench)
    resume = bench.node.create_publisher(Bool, "/explore/resume", 10)
    bench.until(lambda: place.navigator.goals, 5.0)
    resume.publish(Bool(data=False))
    bench.run(3.0)
    assert place.navigator.cancelled == 1
    assert len(place.navigator.goals) == 1
    resume.publish(Bool(data=True))
    bench.until(lambda: len(place.navigator.goals) > 1, 5.0)
    assert told[1:] == ["exploration_paused", "exploration_in_progress"]


@dataclass(slots=True)
class SettableClock(Clock):
    """Somebody sets it back; durations are not told."""

    back_ns: int = 0

    @property
    def steady_ns(self) -> int:
        return self.now_ns + self.back_ns


def test_it_goes_on_where_the_clock_was_set_back() -> None:
    clock = SettableClock(now_ns=7200_000_000_000)
    with Bus.open(clock) as bus:
        bench = Bench(bus, clock)
        place = Place(bench)
        place.navigator.fails = True
        bench.until(lambda: place.node.explorer.given_up, 5.0)
        clock.now_ns, clock.back_ns = clock.now_ns - 3600_000_000_000, 3600_000_000_000
        bench.until(lambda: place.mission.done, 30.0)
        assert len(place.node.explorer.given_up) >= 2


def test_frontiers_are_shown_to_who_listens(bench: Bench) -> None:
    place = Place(bench)
    got = bench.listen(MarkerArray, "/explore/frontiers", 10)
    bench.until(lambda: place.navigator.goals, 5.0)
    _delete, left, right, targets = got[0].markers
    assert len(left.points) == len(right.points) >= 10
    assert len(targets.points) == 2


def test_nothing_happens_without_a_pose(bench: Bench) -> None:
    place = Place(bench)
    place.node._robot_pose = type(place.node._robot_pose)(place.node._robot_pose.buffer, frames=_nowhere())
    bench.run(3.0)
    assert place.navigator.goals == []
    assert not place.mission.done


def _nowhere() -> Any:
    from twin.nodes.navigation.robot_pose import Frames

    return Frames(map="elsewhere")
