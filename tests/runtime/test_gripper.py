"""The gripper's action on a real grip: it presses as it was told, and says what it did."""

from __future__ import annotations

from typing import Any

import pytest

from tests.sim.test_servos import Bot
from twin.bridge.action_types import GripperCommand
from twin.bridge.actions import ActionClient
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import GripperCommandMsg, new
from twin.nodes.gripper_controller import GripperControllerNode


def close(bot: Bot, max_effort: float) -> Any:
    """Close the gripper; return the action's result."""
    clock = Clock()
    with Bus.open(clock) as bus:
        GripperControllerNode(bus, bot.hardware, "left_finger_joint")
        client = ActionClient(bus.create_node("test"), GripperCommand, "gripper_controller/gripper_cmd")
        command = new(GripperCommandMsg, position=0.0, max_effort=max_effort)
        goal = client.send_goal(new(GripperCommand.Goal, command=command))
        while not goal.done:
            assert clock.now_ns < 10_000_000_000, "no result"
            clock.now_ns += 20_000_000
            bus.spin()
            bot.run(0.02)
        return goal.result


@pytest.mark.parametrize(
    ("max_effort", "expected"), [(20.0, 20.0), (40.0, 40.0), (80.0, 80.0), (500.0, 80.0), (0.0, 80.0)]
)
def test_each_finger_presses_with_max_effort_within_its_joints_limit(
    max_effort: float, expected: float
) -> None:
    bot = Bot()
    result = close(bot, max_effort)
    assert (result.stalled, result.reached_goal) == (True, False)
    assert result.position == pytest.approx(0.12, abs=0.002)
    assert result.effort == pytest.approx(expected, rel=1e-6)
    assert bot.pressing() == pytest.approx([expected, expected], rel=0.02)


def test_without_a_tote_it_closes_and_presses_on_nothing() -> None:
    bot = Bot()
    bot.take_tote_away()
    result = close(bot, 40.0)
    assert (result.stalled, result.reached_goal) == (False, True)
    assert result.effort < 4.0
