from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest

from twin.bridge.action_types import Fibonacci, NavigateToPose
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import UUID, GoalInfo, GoalStatus, GoalStatusArray, Time
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import CancelGoal

CODES = CancelGoal.Response


class Server:
    """A Fibonacci server that notes what happens to it."""

    def __init__(self, bus: Bus, **callbacks: Any) -> None:
        self.log: list[str] = []
        self.node = bus.create_node("server", "r")
        self.server = ActionServer(self.node, Fibonacci, "fibonacci", self.execute, **callbacks)

    def execute(self, goal: GoalHandle) -> Generator[None, None, Any]:
        order = goal.request.order
        sequence = [0, 1]
        try:
            while len(sequence) <= order:
                if goal.is_cancel_requested:
                    goal.canceled()
                    return Fibonacci.Result(np.array(sequence, np.int32))
                sequence.append(sequence[-1] + sequence[-2])
                goal.publish_feedback(Fibonacci.Feedback(np.array(sequence, np.int32)))
                yield
            if order == 7:
                goal.abort()
            return Fibonacci.Result(np.array(sequence, np.int32))
        finally:
            self.log.append(f"ended {order}")


def _spin_until_done(bus: Bus, goal: Any, limit: int = 20) -> int:
    for count in range(limit):
        if goal.done:
            return count
        bus.spin()
    raise AssertionError(f"not done after {limit} spins")


@pytest.fixture
def client(bus: Bus) -> ActionClient:
    return ActionClient(bus.create_node("client"), Fibonacci, "/r/fibonacci")


def test_a_goal_is_accepted_reports_and_succeeds(bus: Bus, client: ActionClient) -> None:
    assert not client.server_is_ready
    Server(bus)
    assert client.server_is_ready
    feedback: list[list[int]] = []
    goal = client.send_goal(Fibonacci.Goal(4), lambda f: feedback.append(f.sequence.tolist()))
    assert goal.accepted is None
    bus.spin()
    bus.spin()
    assert goal.accepted
    assert not goal.done
    _spin_until_done(bus, goal)
    assert goal.succeeded
    assert goal.result.sequence.tolist() == [0, 1, 1, 2, 3]
    assert feedback == [[0, 1, 1], [0, 1, 1, 2], [0, 1, 1, 2, 3]]


def test_a_goal_may_abort(bus: Bus, client: ActionClient) -> None:
    Server(bus)
    goal = client.send_goal(Fibonacci.Goal(7))
    _spin_until_done(bus, goal)
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert goal.result.sequence.size == 8


def test_a_goal_may_be_rejected(bus: Bus, client: ActionClient) -> None:
    server = Server(bus, goal_callback=lambda goal: goal.order < 10)
    goal = client.send_goal(Fibonacci.Goal(50))
    _spin_until_done(bus, goal)
    assert goal.accepted is False
    assert goal.result is None
    assert goal.error == "the action /r/fibonacci rejected the goal"
    assert server.server.current is None


def test_a_goal_may_be_cancelled(bus: Bus, client: ActionClient) -> None:
    server = Server(bus)
    goal = client.send_goal(Fibonacci.Goal(1000))
    bus.spin()
    bus.spin()
    answer = goal.cancel()
    _spin_until_done(bus, goal, 4)
    assert goal.status == GoalStatus.STATUS_CANCELED
    assert answer.result.return_code == CODES.ERROR_NONE
    assert [bytes(i.goal_id.uuid) for i in answer.result.goals_canceling] == [goal.goal_id]
    assert server.log == ["ended 1000"]
    late = goal.cancel()
    bus.spin()
    bus.spin()
    assert late.result.return_code == CODES.ERROR_GOAL_TERMINATED


def test_a_cancel_may_be_refused(bus: Bus, client: ActionClient) -> None:
    Server(bus, cancel_callback=lambda handle: False)
    goal = client.send_goal(Fibonacci.Goal(5))
    bus.spin()
    answer = goal.cancel()
    _spin_until_done(bus, goal)
    assert goal.succeeded
    assert answer.result.return_code == CODES.ERROR_REJECTED


def test_cancel_all_and_cancel_unknown(bus: Bus, client: ActionClient) -> None:
    Server(bus)
    goal = client.send_goal(Fibonacci.Goal(1000))
    bus.spin()
    bus.spin()
    cancel = bus.create_node("other").create_client(CancelGoal, "/r/fibonacci/_action/cancel_goal")
    nobody = UUID(np.arange(16, dtype=np.uint8))
    unknown = cancel.call_async(CancelGoal.Request(GoalInfo(nobody, Time(0, 0))))
    everything = cancel.call_async(CancelGoal.Request(GoalInfo(UUID(np.zeros(16, np.uint8)), Time(0, 0))))
    _spin_until_done(bus, goal)
    assert goal.status == GoalStatus.STATUS_CANCELED
    assert unknown.result.return_code == CODES.ERROR_UNKNOWN_GOAL_ID
    assert everything.result.return_code == CODES.ERROR_NONE


def test_a_new_goal_preempts_the_old_one(bus: Bus, client: ActionClient) -> None:
    server = Server(bus)
    old = client.send_goal(Fibonacci.Goal(1000))
    for _ in range(3):
        bus.spin()
    fresh = client.send_goal(Fibonacci.Goal(3))
    _spin_until_done(bus, fresh)
    assert old.done
    assert old.status == GoalStatus.STATUS_ABORTED
    assert fresh.succeeded
    assert server.log == ["ended 1000", "ended 3"]


def test_status_is_published_for_everybody(bus: Bus, client: ActionClient) -> None:
    Server(bus)
    seen: list[list[int]] = []
    bus.create_node("watch").create_subscription(
        GoalStatusArray,
        "/r/fibonacci/_action/status",
        lambda m: seen.append([s.status for s in m.status_list]),
        LATCHED,
    )
    goal = client.send_goal(Fibonacci.Goal(3))
    _spin_until_done(bus, goal)
    bus.spin()
    assert seen[-1] == [GoalStatus.STATUS_SUCCEEDED]
    assert [GoalStatus.STATUS_EXECUTING] in seen


def test_without_a_server_a_goal_ends_with_an_error(bus: Bus, client: ActionClient) -> None:
    goal = client.send_goal(Fibonacci.Goal(3))
    _spin_until_done(bus, goal)
    assert goal.accepted is False
    assert goal.error is not None
    assert "/r/fibonacci" in goal.error


def test_an_exception_in_an_execution_is_not_swallowed(bus: Bus, client: ActionClient) -> None:
    def broken(goal: GoalHandle) -> Generator[None, None, Any]:
        yield
        raise ZeroDivisionError

    ActionServer(bus.create_node("server", "r"), Fibonacci, "fibonacci", broken)
    goal = client.send_goal(Fibonacci.Goal(3))
    with pytest.raises(ZeroDivisionError):
        _spin_until_done(bus, goal)


def test_a_goal_of_another_type_is_refused(client: ActionClient) -> None:
    with pytest.raises(TypeError, match="Fibonacci_Goal"):
        client.send_goal(NavigateToPose.Feedback)


def test_closing_the_bus_lets_the_execution_clean_up(bus: Bus, client: ActionClient) -> None:
    server = Server(bus)
    client.send_goal(Fibonacci.Goal(1000))
    for _ in range(3):
        bus.spin()
    bus.close()
    assert server.log == ["ended 1000"]


class Held:
    """Holds every goal back."""

    def __init__(self, bus: Bus) -> None:
        self.goals: list[tuple[ActionClient, Any, Any]] = []
        bus.hold_goal = lambda *goal: not self.goals.append(goal)  # type: ignore[func-returns-value]


def test_a_goal_that_is_held_back_is_sent_when_somebody_says_so(bus: Bus, client: ActionClient) -> None:
    server, held = Server(bus), Held(bus)
    sent = client.send_goal(Fibonacci.Goal(4))
    for _ in range(5):
        bus.spin()
    assert sent.held
    assert sent.accepted is None
    assert server.server.current is None
    ((who, goal, message),) = held.goals
    assert (who, goal, message.order) == (client, sent, 4)
    client.post(sent, Fibonacci.Goal(5))
    assert not sent.held
    _spin_until_done(bus, sent)
    assert sent.result.sequence.tolist() == [0, 1, 1, 2, 3, 5], "with the message that was posted"


def test_a_goal_that_is_held_back_can_be_answered_by_somebody_else(bus: Bus, client: ActionClient) -> None:
    server = Server(bus)
    Held(bus)
    sent = client.send_goal(Fibonacci.Goal(4))
    client.answer(sent, GoalStatus.STATUS_SUCCEEDED, Fibonacci.Result(np.array([7], np.int32)))
    assert sent.done
    assert sent.succeeded
    assert sent.result.sequence.tolist() == [7]
    for _ in range(5):
        bus.spin()
    assert server.log == []


def test_a_goal_that_is_held_back_ends_when_it_is_cancelled(bus: Bus, client: ActionClient) -> None:
    Server(bus)
    Held(bus)
    sent = client.send_goal(Fibonacci.Goal(4))
    answer = sent.cancel()
    assert sent.done
    assert sent.status == GoalStatus.STATUS_CANCELED
    bus.spin()
    bus.spin()
    assert answer.result.return_code == CODES.ERROR_UNKNOWN_GOAL_ID
