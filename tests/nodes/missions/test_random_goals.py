"""Random goals: drawn where there is room, counted in metres, given up as configured."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.conversions import pose2_from_pose, twist_from_planar
from twin.bridge.msgs import Twist, new
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.missions.random_goals import RandomGoalsNode, open_places
from twin.nodes.missions.random_goals_config import RandomGoalsConfig
from twin.nodes.navigation.mapping.map_server import MapServerNode


class Navigator:
    """Drives nowhere: the robot turns in circles while a goal takes two seconds."""

    def __init__(self, bench: Bench, *, gives_up: bool = False) -> None:
        self.bench, self.gives_up = bench, gives_up
        self.goals: list[Pose2] = []
        ActionServer(bench.node, NavigateToPose, "navigate_to_pose", self._execute)

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        self.goals.append(pose2_from_pose(handle.request.pose.pose))
        start = self.bench.now_s
        while self.bench.now_s < start + 2.0:
            yield
        if self.gives_up:
            handle.abort()
            return new(NavigateToPose.Result, error_code=1, error_msg="no way")
        return new(NavigateToPose.Result)


def mission(bench: Bench, robot: Robot, seed: int = 1, **config: Any) -> RandomGoalsNode:
    MapServerNode(bench.bus, map_of_room())
    settings = RandomGoalsConfig(**{"distance": 2.0, "min_goal_distance": 1.0, **config})
    return RandomGoalsNode(bench.bus, robot.pose_lookup, settings, seed=seed)


def drive_in_circles(bench: Bench) -> None:
    publisher = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)
    bench.each_tick.append(lambda: publisher.publish(twist_from_planar(0.3, 0.6)))


def test_it_ends_when_so_many_metres_are_driven_and_the_goal_is_reached(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    navigator, node = Navigator(bench), mission(bench, robot)
    drive_in_circles(bench)
    bench.until(lambda: node.done, 30.0)
    assert node.succeeded
    assert node.driven >= 2.0
    assert node.reached == len(navigator.goals) >= 2
    room = map_of_room()
    for goal in navigator.goals:
        nearby = [
            room.value_at([goal.x + 0.65 * np.cos(a), goal.y + 0.65 * np.sin(a)])
            for a in np.arange(0, 6.3, 0.1)
        ]
        assert set(map(int, nearby)) == {0}, "0.7 m of room about every goal"


def goals_of(seed: int) -> list[Pose2]:
    clock = Clock()
    with Bus.open(clock) as bus:
        bench = Bench(bus, clock)
        robot, navigator = Robot(bench, open_room()), Navigator(bench)
        mission(bench, robot, seed)
        bench.run(7.0)
    return navigator.goals


def test_the_seed_draws_the_goals() -> None:
    first = goals_of(7)
    assert len(first) >= 3
    assert goals_of(7) == first
    assert goals_of(8)[0] != first[0]


def test_a_goal_that_is_given_up_ends_it_with_the_navigators_reason(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    navigator, node = Navigator(bench, gives_up=True), mission(bench, robot, max_failed=1, retries=0)
    bench.until(lambda: node.done, 30.0)
    assert not node.succeeded
    assert node.failed == len(navigator.goals) == 2
    assert node.reason.endswith("no way")


def test_a_goal_that_somebody_stands_on_is_sent_again_after_another_one(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    navigator, node = Navigator(bench, gives_up=True), mission(bench, robot, retries=1)
    bench.until(lambda: len(navigator.goals) == 1, 20.0)
    bench.until(lambda: len(navigator.goals) == 2, 20.0)
    navigator.gives_up = False
    bench.until(lambda: node.reached == 2, 20.0)
    first, other, again = navigator.goals[:3]
    assert first == again != other
    assert node.failed == 0


def test_what_was_put_off_is_told_at_the_end(bench: Bench) -> None:
    robot, logs = Robot(bench, open_room()), bench.logs()
    navigator, node = Navigator(bench, gives_up=True), mission(bench, robot, distance=0.3)
    drive_in_circles(bench)
    bench.until(lambda: node.done, 30.0)
    bench.tick()
    (goal,) = navigator.goals
    assert f"0 goals reached, 0 given up, put off ({goal.x:.2f}, {goal.y:.2f})" in logs


def test_a_map_without_room_is_told(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    Navigator(bench)
    node = mission(bench, robot, min_goal_distance=50.0)
    bench.until(lambda: node.done, 5.0)
    assert not node.succeeded
    assert "no free place" in node.reason


def test_places_behind_a_wall_are_not_offered() -> None:
    data = np.zeros((40, 80), dtype=np.int8)
    data[:, 40] = 100
    grid = OccupancyMap(data=data, resolution=0.1, origin=Pose2(0.0, 0.0, 0.0))
    places = open_places(grid, Pose2(1.0, 2.0, 0.0), 0.5)
    assert len(places)
    assert places[:, 0].max() < 4.0 - 0.45
