"""Obstacles that come into a robot's way."""

from __future__ import annotations

from collections.abc import Callable

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

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
