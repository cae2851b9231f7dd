"""Obstacles that come into a robot's way."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.geometry import Pose2, Pose3
from twin.navigation.costmaps.footprint import rectangle
from twin.runtime.obstacles import ObstacleSchedule, Outline, Walker
from twin.runtime.run import Run
from twin.scenario.schema import Scenario
from twin.scenario.world import Obstacle, PoseConfig

TEXT = """
name: crate
duration: 20 s
world:
  obstacles: [{name: crate, pose: {x: 2}, size: [0.4, 1.0, 0.6], appears_within: 1 m}]
robots: [{model: diff_bot}]
checks: [{no_collision: }]
"""


def test_an_obstacle_appears_when_the_robot_is_near_and_is_seen_and_touched(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    ahead: list[tuple[float, float]] = []
    run = make_run(scenario(TEXT))
    (stack,) = run.parts.stacks.values()

    def on_sample(sample: object) -> None:
        if sample.topic == "/scan":  # type: ignore[attr-defined]
            ranges = sample.message.ranges  # type: ignore[attr-defined]
            ahead.append((float(run.world.pose(stack.handle.base).xyz[0]), float(ranges[len(ranges) // 2])))

    run.bus.tap(on_sample)
    publisher = run.bus.create_node("teleop").create_publisher(Twist, "/cmd_vel", 1)
    while not run.over:
        publisher.publish(twist_from_planar(0.3, 0.0))
        run.tick()
    assert all(distance == float("inf") for x, distance in ahead if x < 0.78), "nothing there at first"
    assert all(distance < 1.1 for x, distance in ahead if x > 0.85), "then the lidar sees it"
    (check,) = run.checks
    assert "hit crate" in check.result().reason
    assert run.world.pose(stack.handle.base).xyz[0] < 1.8, "and it stops the robot"


WALKER = Obstacle(name="walker", size=(0.4, 0.4, 1.0), route=((3.0, 0.0), (3.0, 1.0)), speed=0.5)


def test_a_walker_goes_along_its_route_and_back() -> None:
    walker = Walker(WALKER)
    places = []
    for _ in range(161):
        walker.walk(0.1, [])
        places.append((walker.pose.x, walker.pose.y))
    assert places[19] == pytest.approx((1.0, 0.0))
    assert places[69] == pytest.approx((3.0, 0.5))
    assert max(y for _, y in places) == 1.0
    assert places[160] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_walker_stops_before_a_robot_and_turns_back_when_it_does_not_go_away() -> None:
    walker = Walker(WALKER)
    robot = Pose2(2.0, 0.0, 0.0)
    places = [(walker.walk(0.1, [robot]), walker.pose.x)[1] for _ in range(60)]
    assert max(places) <= 2.0 - 0.2 - 1.0 + 1e-9, "a metre between its footprint and the robot's base"
    assert places[45:] == sorted(places[45:], reverse=True), "patience is over"
    near = Walker(WALKER)
    assert near.walk(0.1, [Pose2(-0.5, 0.0, 0.0)]), "who walks away from a robot need not wait"


def test_a_walker_does_not_walk_into_a_robots_corner_that_its_base_is_no_nearer_for() -> None:
    cart = WALKER.model_copy(update={"size": (1.2, 0.4, 1.0)})
    beside = Pose2(0.55, -0.7, 0.5)  # along its side, but the robot's nose reaches before it
    outline, (nose,) = Outline.of(rectangle(1.2, 0.6)), beside.apply(np.array([[0.6, 0.3]]))
    assert abs(nose[1]) < 0.2
    blind, careful = Walker(cart), Walker(cart)
    for _ in range(60):
        blind.walk(0.02, [beside])
        careful.walk(0.02, [beside], [outline])
    assert blind.pose.x + 0.6 > nose[0] > careful.pose.x + 0.6 + 0.25


def test_how_far_an_outline_is_from_a_box() -> None:
    outline, box = Outline.of(rectangle(0.8, 0.6)), (0.4, 0.4)
    assert outline.gap(Pose2(1.0, 0.1, 0.0), box) == pytest.approx(0.4)
    assert outline.gap(Pose2(0.1, -1.0, np.pi / 2), box) == pytest.approx(0.4)
    assert outline.gap(Pose2(1.0, 0.0, np.arctan2(0.3, 0.4)), box) == pytest.approx(0.3), "its corner leads"
    assert outline.gap(Pose2(0.0, 0.0, 0.6) @ Pose2(0.0, 1.0, 0.0), box) == pytest.approx(
        0.7 - 0.2 * (np.cos(0.6) + np.sin(0.6))
    ), "the box's corner before its side"
    assert outline.gap(Pose2(0.55, 0.0, 0.0), box) == pytest.approx(-0.05), "inside"
    assert Outline.of(np.zeros((1, 2))).gap(Pose2(1.0, 0.0, 0.3), box) == pytest.approx(0.8), "a point"


@pytest.mark.parametrize("y", [0.54, 0.52], ids=["beside its way", "over its way"])
def test_a_walker_does_not_squeeze_along_a_robot_that_comes_into_its_way(y: float) -> None:
    outline = Outline.of(rectangle(0.82, 0.57))
    walker = Walker(WALKER.model_copy(update={"route": ((-3.0, 0.0),), "pose": PoseConfig(x=3.0)}))
    while walker.pose.x > 1.27:  # when the robot comes, the walker is beside its tail
        walker.walk(0.02, [])
    robot = Pose2(1.09, y, -2.91)
    for step in range(300):
        if step < 80:  # its nose crosses the way
            robot = robot @ Pose2(0.004, 0.0, 0.0)
        walker.walk(0.02, [robot], [outline])
        assert outline.gap(walker.pose.inverse() @ robot, (0.4, 0.4)) > 0.0
    assert walker.pose.x > 1.5, "patience is over, and there is a way back"


def test_a_walker_does_not_walk_through_a_corner_that_reaches_into_its_way() -> None:
    outline = Outline.of(rectangle(0.82, 0.57))
    walker = Walker(WALKER.model_copy(update={"route": ((-3.0, 0.0),), "pose": PoseConfig(x=3.0)}))
    while walker.pose.x > 0.6:
        walker.walk(0.02, [])
    robot = Pose2(0.6, 0.0, -2.92) @ Pose2(-0.41, -0.285, 0.0)  # with its nose's left corner over the way
    robot = Pose2(robot.x, robot.y + 0.19, robot.yaw)
    assert outline.gap(walker.pose.inverse() @ robot, (0.4, 0.4)) == pytest.approx(-0.01)
    for _ in range(100):
        walker.walk(0.02, [robot], [outline])
    assert walker.pose.x == pytest.approx(0.6, abs=0.02)


class Floor:
    """A world of nothing but time and what walks in it."""

    def __init__(self) -> None:
        self.time_ns = 0
        self.at = Pose2(0.0, 0.0, 0.0)

    def place(self, _name: str, pose: Pose3) -> None:
        self.at = pose.to_pose2()


def test_a_walker_lets_a_robot_pass_that_cannot_stop_any_more() -> None:
    floor = Floor()
    walker = WALKER.model_copy(update={"route": ((6.0, 0.0),)})
    schedule = ObstacleSchedule(floor, [walker], [rectangle(0.82, 0.57)])  # type: ignore[arg-type]
    outline = Outline.of(rectangle(0.82, 0.57))
    robot, speed, nearest = Pose2(0.0, 1.4, -0.9), 0.8, math.inf
    for _ in range(200):
        floor.time_ns += 20_000_000
        gap = outline.gap(floor.at.inverse() @ robot, (0.4, 0.4))
        if gap < 0.15:  # then it brakes, at 0.8 m/s²
            speed = max(0.0, speed - 0.8 * 0.02)
        robot = robot @ Pose2(speed * 0.02, 0.0, 0.0)
        schedule.update([robot])
        nearest = min(nearest, gap)
    assert nearest > 0.0


def test_a_walker_is_seen_by_the_lidar_where_it_walks(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    run = make_run(scenario(TEXT.replace("appears_within: 1 m", "route: [[4, 0]], speed: 0.4")))
    ahead: list[tuple[float, float]] = []

    def on_sample(sample: object) -> None:
        if sample.topic == "/scan":  # type: ignore[attr-defined]
            ranges = sample.message.ranges  # type: ignore[attr-defined]
            ahead.append((run.world.time_ns * 1e-9, float(ranges[len(ranges) // 2])))

    run.bus.tap(on_sample)
    while run.world.time_ns < 3e9:
        run.tick()
    (early, near), (late, far) = ahead[0], ahead[-1]
    assert far - near == pytest.approx(0.4 * (late - early), abs=0.05)
