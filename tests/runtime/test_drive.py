"""Driving over the bus: who commands, what is refused, what stops the robot."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

TEXT = """
name: drive
duration: 60 s
robots: [{model: MODEL}]
checks: [{odometry_drift: {max: 1 m}}]
"""


@pytest.fixture(params=["diff_bot", "sp1s"])
def run(
    request: pytest.FixtureRequest, scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> Run:
    return make_run(scenario(TEXT.replace("MODEL", request.param)))


def drive(run: Run, seconds: float, v: float, w: float) -> None:
    """Publish commands at 10 Hz for some simulated time, as `ros2 topic pub -r 10` does."""
    publisher = run.bus.create_node(f"teleop_{run.world.step_count}").create_publisher(Twist, "/cmd_vel", 1)
    end = run.world.time_ns + round(seconds * 1e9)
    while run.world.time_ns < end:
        if run.world.time_ns % 100_000_000 == 0:
            publisher.publish(twist_from_planar(v, w))
        run.tick()


def test_a_circle_is_driven_as_commanded(run: Run) -> None:
    (stack,) = run.parts.stacks.values()
    drive(run, 2.0, 0.1, 0.5)
    start = run.world.pose(stack.handle.base).to_pose2()
    drive(run, 4 * math.pi, 0.1, 0.5)
    end = run.world.pose(stack.handle.base).to_pose2()
    assert start.distance(end) < 0.05, "a full circle of 0.2 m radius ends where it began"
    odom = stack.robot_pose.in_odom()
    assert odom is not None
    assert odom.distance(end) < 0.05


def test_without_commands_the_robot_stops(run: Run) -> None:
    (stack,) = run.parts.stacks.values()
    drive(run, 1.0, 0.2, 0.0)
    for _ in range(75):
        run.tick()
    before = run.world.pose(stack.handle.base).to_pose2()
    for _ in range(50):
        run.tick()
    assert before.distance(run.world.pose(stack.handle.base).to_pose2()) < 1e-3


def test_nan_is_refused_and_said(run: Run) -> None:
    said: list[str] = []
    run.bus.tap(lambda sample: said.append(sample.message.msg) if sample.topic == "/rosout" else None)
    (stack,) = run.parts.stacks.values()
    drive(run, 1.0, math.nan, 0.0)
    drive(run, 0.5, 0.2, math.inf)
    assert any("must be finite" in text for text in said)
    assert stack.robot_pose.in_odom().distance(run.world.pose(stack.handle.base).to_pose2()) < 0.01  # type: ignore[union-attr]
    drive(run, 2.0, 0.2, 0.0)
    assert run.world.pose(stack.handle.base).xyz[0] > 0.2, "the robot still drives after refusing"


def test_odometry_drifts_and_says_so(run: Run) -> None:
    (stack,) = run.parts.stacks.values()
    drive(run, 10.0, 0.2, 0.4)
    truth, odom = run.world.pose(stack.handle.base).to_pose2(), stack.robot_pose.in_odom()
    assert odom is not None
    assert 1e-5 < truth.distance(odom) < 0.1, "encoders never know the truth exactly"


def test_each_seed_draws_wheels_of_its_own(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    errors = []
    for seed in (1, 2, 3):
        run = make_run(scenario(TEXT.replace("MODEL", "diff_bot") + f"seed: {seed}\n"))
        (stack,) = run.parts.stacks.values()
        drive(run, 10.0, 0.3, 0.0)
        truth, odom = run.world.pose(stack.handle.base).to_pose2(), stack.robot_pose.in_odom()
        assert odom is not None
        errors.append(odom.y - truth.y)
    assert max(map(abs, errors)) < 0.1, "3 m straight"
    assert len({round(error, 4) for error in errors}) == 3, "the heading drifts differently with each pair"
