"""A robot whose autonomy runs on its own computer, beside a mirror that only watches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.live.beside import Beside, plant
from twin.bridge.msgs import Twist
from twin.live.mirror.mirror import Mirror
from twin.scenario.schema import load

EIGHT = {"mission.steps": "[{duration: 4 s, linear: 0.2 m/s, angular: 22.5 deg/s}]"}
PATROL = {"world.obstacles": "[]"}


@pytest.mark.parametrize(
    ("name", "overrides", "seconds", "mission"),
    [
        ("diff_bot_figure8", EIGHT, 8.0, "done"),
        pytest.param("warehouse_patrol", PATROL, 20.0, "goal 2: ", marks=pytest.mark.long),
    ],
)
def test_it_is_a_shadow_because_nothing_commands_it_from_here_and_its_mission_is_followed(
    name: str, overrides: dict[str, Any], seconds: float, mission: str
) -> None:
    scenario = load(name, overrides)
    robots = plant(scenario, "latency=80ms,loss=2%,clock_offset=0.4s", autonomy=True)
    errors, states = [], set()
    with Mirror(scenario, Beside(robots, delay_s=0.02)) as mirror:
        world, physical = mirror.run.run.world, robots.run.run.world
        (base,) = (robot.base for robot in world.robots.values())

        def note() -> bool:
            errors.append(world.pose(base).to_pose2().distance(physical.pose(base).to_pose2()))
            states.update(mirror.statuses()[0].told.values())
            return world.time_ns >= seconds * 1e9

        mirror.advance(note)
        (status,) = mirror.statuses()
        assert (
            physical.pose(base).to_pose2().distance(robots.run.run.parts.stacks[status.robot].context.start)
            > 0.3
        )
    assert (status.judgement.label, status.judgement.why) == (
        "shadow",
        ("nothing commands the robot from here",),
    )
    assert world.time_ns >= seconds * 1e9, "neither ends with the mission"
    assert max(errors[100:]) < 0.05
    assert any(state.startswith(mission) for state in states), states
    assert status.resets == 0


def test_autonomy_here_drives_a_robot_on_that_starts_again_by_a_clock_far_behind() -> None:
    """In the middle of a goal: what waits for a time must not wait until the clock shows it again."""
    scenario = load("warehouse_patrol", PATROL | {"mission.max_failed": "1000"})
    robots = plant(scenario)
    cable = Beside(robots)
    with Mirror(scenario, cable, autonomy="all") as mirror:
        world = mirror.run.run.world
        speeds: list[float] = []
        node = mirror.run.run.bus.create_node("listener")
        node.create_subscription(Twist, "/cmd_vel", lambda told: speeds.append(abs(told.linear.x)), 10)

        def go_on(seconds: float, until: Callable[[], bool] = lambda: False) -> None:
            end_ns = world.time_ns + round(seconds * 1e9)
            mirror.advance(lambda: world.time_ns >= end_ns or until())

        go_on(4.0)
        assert mirror.statuses()[0].judgement.label == "twin"
        cable.kill(robots)
        go_on(1.5)
        again = plant(scenario, "clock_offset=-74.5s")
        cable.start(again)
        physical = again.run.run.world
        (base,) = (robot.base for robot in physical.robots.values())
        start = physical.pose(base).to_pose2()

        def is_a_twin_again() -> bool:
            is_twin = mirror.statuses()[0].judgement.label == "twin"
            return is_twin and physical.pose(base).to_pose2().distance(start) > 1.0

        go_on(25.0, is_a_twin_again)
        assert is_a_twin_again()
        assert max(speeds) <= 1.0, "no command is beyond what the robot can do"
