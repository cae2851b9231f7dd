"""The server's side of actions in full: states, policies, deferral, expiry, destruction."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest

from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import (
    ActionClient,
    ActionServer,
    CancelResponse,
    ClientGoal,
    GoalHandle,
    GoalResponse,
)
from twin.bridge.actions.goal import ACTIVE, NAMES, GoalEvent, transition, uuid_msg
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import GoalStatus, GoalStatusArray
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import CancelGoal
from twin.errors import BridgeError

CODES = CancelGoal.Response
SECOND = 1_000_000_000


def result(*numbers: int) -> Any:
    return Fibonacci.Result(np.array(numbers, np.int32))


def count(handle: GoalHandle) -> Generator[None, None, Any]:
    """Take `order` spins, or until cancelled; the result is [order]."""
    for _ in range(handle.request.order):
        if handle.is_cancel_requested:
            handle.canceled()
            return result(-1)
        yield
    return result(handle.request.order)


@pytest.fixture
def client(bus: Bus) -> ActionClient:
    return ActionClient(bus.create_node("client"), Fibonacci, "count")


def serve(bus: Bus, *args: Any, **options: Any) -> ActionServer:
    return ActionServer(bus.create_node("server"), Fibonacci, "count", *(args or (count,)), **options)


def spin(bus: Bus, times: int = 4) -> None:
    for _ in range(times):
        bus.spin()


def send(client: ActionClient, *orders: int) -> list[ClientGoal]:
    return [client.send_goal(Fibonacci.Goal(order)) for order in orders]


def states(goals: list[ClientGoal]) -> list[str]:
    return [NAMES[goal.status] for goal in goals]


# Rows as in the table of rcl_action/goal_state_machine.c: EXECUTE, CANCEL_GOAL, SUCCEED, ABORT, CANCELED.
TABLE = {
    "ACCEPTED": ("EXECUTING", "CANCELING", None, None, None),
    "EXECUTING": (None, "CANCELING", "SUCCEEDED", "ABORTED", None),
    "CANCELING": (None, None, "SUCCEEDED", "ABORTED", "CANCELED"),
    "SUCCEEDED": (None,) * 5,
    "CANCELED": (None,) * 5,
    "ABORTED": (None,) * 5,
    "UNKNOWN": (None,) * 5,
}


@pytest.mark.parametrize(("state", "event"), [*product(NAMES.items(), enumerate(GoalEvent))])
def test_states_change_as_in_rcl_action(state: tuple[int, str], event: tuple[int, GoalEvent]) -> None:
    following = TABLE[state[1]][event[0]]
    if following is None:
        with pytest.raises(BridgeError, match=f"a goal that is {state[1]} cannot {event[1].value}; valid: "):
            transition(state[0], event[1])
    else:
        assert NAMES[transition(state[0], event[1])] == following


def test_policy_parallel_executes_all(bus: Bus, client: ActionClient) -> None:
    server = serve(bus, policy="parallel")
    goals = send(client, 5, 2, 1)
    spin(bus, 2)
    assert [handle.request.order for handle in server.goals] == [5, 2]
    spin(bus, 6)
    assert [goal.result.sequence.tolist() for goal in goals] == [[5], [2], [1]]
    assert states(goals) == ["SUCCEEDED"] * 3


def test_policy_queue_executes_one_after_the_other(bus: Bus, client: ActionClient) -> None:
    serve(bus, policy="queue")
    goals = send(client, 3, 3, 3)
    spin(bus, 2)
    assert states(goals) == ["EXECUTING", "ACCEPTED", "ACCEPTED"]
    goals[1].cancel()
    spin(bus, 2)
    assert states(goals)[1] == "CANCELED"  # at once: nothing of it has begun
    spin(bus, 9)
    assert states(goals) == ["SUCCEEDED", "CANCELED", "SUCCEEDED"]


def test_policy_reject_has_one_goal(bus: Bus, client: ActionClient) -> None:
    serve(bus, policy="reject")
    goals = send(client, 2, 1)
    spin(bus, 6)
    assert [goal.accepted for goal in goals] == [True, False]
    (again,) = send(client, 1)
    spin(bus)
    assert again.succeeded


def test_policies_have_names(bus: Bus) -> None:
    with pytest.raises(BridgeError, match="valid: preempt, parallel, queue, reject"):
        serve(bus, policy="first")


def test_rclpys_answers_are_understood(bus: Bus, client: ActionClient) -> None:
    serve(
        bus,
        count,
        lambda goal: GoalResponse.ACCEPT if goal.order > 0 else GoalResponse.REJECT,
        lambda handle: CancelResponse.REJECT,
    )
    goals = send(client, 0)
    spin(bus)
    goals += send(client, 3)
    answer = goals[1].cancel()
    spin(bus, 8)
    assert [goal.accepted for goal in goals] == [False, True]
    assert answer.result.return_code == CODES.ERROR_REJECTED


def test_a_goal_may_be_executed_later(bus: Bus, client: ActionClient) -> None:
    waiting: list[GoalHandle] = []
    serve(bus, handle_accepted_callback=waiting.append)
    goals = send(client, 1)
    spin(bus)
    assert states(goals) == ["ACCEPTED"]
    waiting[0].execute()
    spin(bus)
    assert states(goals) == ["SUCCEEDED"]
    with pytest.raises(BridgeError, match="a goal that is SUCCEEDED cannot execute"):
        waiting[0].execute()


def test_a_goal_cancelled_before_its_execution_ends_there(bus: Bus, client: ActionClient) -> None:
    waiting: list[GoalHandle] = []
    serve(bus, policy="parallel", handle_accepted_callback=waiting.append)
    goals = send(client, 5, 5)
    spin(bus, 1)
    for goal in goals:
        goal.cancel()
    spin(bus, 2)
    assert states(goals) == ["CANCELING"] * 2
    waiting[0].execute()
    waiting[1].canceled()
    spin(bus)
    assert states(goals) == ["CANCELED"] * 2
    assert [goal.result.sequence.tolist() for goal in goals] == [[-1], []]


def test_feedback_at_acceptance_comes_after_the_answer(bus: Bus, client: ActionClient) -> None:
    def accepted(handle: GoalHandle) -> None:
        handle.publish_feedback(Fibonacci.Feedback(np.array([7], np.int32)))
        handle.execute()

    serve(bus, handle_accepted_callback=accepted)
    seen: list[tuple[bool | None, int]] = []
    goal = client.send_goal(Fibonacci.Goal(1), lambda f: seen.append((goal.accepted, int(f.sequence[0]))))
    spin(bus)
    assert seen == [(True, 7)]


def test_success_may_win_over_a_cancel(bus: Bus, client: ActionClient) -> None:
    def stubborn(handle: GoalHandle) -> Generator[None, None, Any]:
        while not handle.is_cancel_requested:
            yield
        return result(1)

    serve(bus, stubborn)
    goals = send(client, 1)
    spin(bus, 2)
    answer = goals[0].cancel()
    spin(bus)
    assert answer.result.return_code == CODES.ERROR_NONE
    assert states(goals) == ["SUCCEEDED"]
    late = goals[0].cancel()
    spin(bus, 2)
    assert late.result.return_code == CODES.ERROR_GOAL_TERMINATED


def test_cancel_by_time_of_acceptance(bus: Bus, client: ActionClient, clock: Clock) -> None:
    serve(bus, policy="parallel")
    goals = []
    for now_s in (1, 2, 3):
        clock.now_ns = now_s * SECOND
        goals += send(client, 50)
        spin(bus, 2)
    answer = client.cancel_before(2 * SECOND)
    spin(bus)
    assert states(goals) == ["CANCELED", "CANCELED", "EXECUTING"]
    assert len(answer.result.goals_canceling) == 2
    client.cancel_all()
    spin(bus)
    assert states(goals) == ["CANCELED"] * 3
    nothing = client.cancel_all()
    spin(bus)
    assert (nothing.result.return_code, nothing.result.goals_canceling) == (CODES.ERROR_NONE, [])


def test_results_can_be_asked_for_until_they_expire(bus: Bus, client: ActionClient, clock: Clock) -> None:
    serve(bus, result_timeout_ns=10 * SECOND)
    goals = send(client, 1)
    unknown = client.get_result(bytes(range(16)))
    early = client.get_result(goals[0].goal_id)
    spin(bus)
    assert unknown.result.status == GoalStatus.STATUS_UNKNOWN
    assert early.result.result.sequence.tolist() == [1]
    for now_s, status in ((10, GoalStatus.STATUS_SUCCEEDED), (11, GoalStatus.STATUS_UNKNOWN)):
        clock.now_ns = now_s * SECOND
        spin(bus, 1)
        late = client.get_result(goals[0].goal_id)
        spin(bus)
        assert late.result.status == status


def test_a_server_does_not_remember_goals_for_ever(bus: Bus, client: ActionClient) -> None:
    serve(bus, policy="parallel")
    lengths: list[int] = []
    bus.create_node("watch").create_subscription(
        GoalStatusArray, "count/_action/status", lambda m: lengths.append(len(m.status_list)), LATCHED
    )
    for _ in range(40):
        send(client, 1)
        spin(bus, 3)
    assert lengths[-1] < 20


def test_an_id_is_accepted_once(bus: Bus, client: ActionClient) -> None:
    serve(bus, policy="parallel")
    goals = send(client, 9)
    request = Fibonacci.SendGoal.Request
    spin(bus, 2)
    again = bus.create_node("other").create_client(Fibonacci.SendGoal, "count/_action/send_goal")
    future = again.call_async(request(uuid_msg(goals[0].goal_id), Fibonacci.Goal(1)))
    spin(bus, 2)
    assert not future.result.accepted


def test_a_mistake_in_an_execution_is_told(bus: Bus, client: ActionClient) -> None:
    def wrong(handle: GoalHandle) -> Iterator[None]:
        handle.canceled()
        yield

    serve(bus, wrong)
    send(client, 1)
    with pytest.raises(BridgeError, match=r"EXECUTING cannot canceled; valid: cancel_goal, succeed, abort"):
        spin(bus)


@pytest.mark.parametrize("what", ["node", "server"])
def test_a_server_destroyed_in_the_middle_aborts_its_goals(bus: Bus, client: ActionClient, what: str) -> None:
    server = serve(bus, policy="queue")
    goals = send(client, 50, 50)
    spin(bus, 2)
    handle = server.current
    assert handle is not None
    thing: Any = server if what == "server" else next(n for n in bus.nodes if n.name == "server")
    thing.destroy()
    thing.destroy()
    handle.publish_feedback(Fibonacci.Feedback(np.zeros(0, np.int32)))
    spin(bus)
    assert states(goals) == ["ABORTED", "ABORTED"]
    assert handle.status not in ACTIVE
    (late,) = send(client, 1)
    spin(bus)
    assert late.error == "no server of the action /count answered; is its node running?"


def test_a_node_may_destroy_itself_in_its_own_execution(bus: Bus, client: ActionClient) -> None:
    log: list[str] = []

    def suicidal(handle: GoalHandle) -> Generator[None, None, Any]:
        try:
            yield
            server_node.destroy()
            log.append("still here")
            yield
            log.append("never")
        finally:
            log.append("cleaned up")

    server_node = bus.create_node("server")
    ActionServer(server_node, Fibonacci, "count", suicidal)
    goals = send(client, 1)
    spin(bus, 5)
    assert log == ["still here", "cleaned up"]
    assert states(goals) == ["ABORTED"]


def test_a_client_may_go_while_its_goal_is_executed(bus: Bus, client: ActionClient) -> None:
    server = serve(bus)
    goals = send(client, 3)
    spin(bus, 2)
    client.destroy()
    assert goals[0].error == "the client of the action /count was destroyed"
    spin(bus, 5)
    assert server.current is None


def test_a_server_that_is_gone_is_one_sentence(bus: Bus, client: ActionClient) -> None:
    server = serve(bus)
    goals = send(client, 50)
    spin(bus, 2)
    for service in server._services:  # as if the process had been killed: nothing is aborted
        service.destroy()
    spin(bus)
    assert goals[0].error == "the server of the action /count went away before the goal had ended"


def test_the_courses_fibonacci(bus: Bus, client: ActionClient, clock: Clock) -> None:
    """It rejects orders below one, gives feedback once a second, and can be cancelled."""
    node = bus.create_node("fibonacci")

    def execute(handle: GoalHandle) -> Generator[None, None, Any]:
        rate = node.create_rate(1.0)
        sequence = [0, 1]
        for i in range(1, handle.request.order):
            if handle.is_cancel_requested:
                handle.canceled()
                return result(*sequence)
            sequence.append(sequence[i] + sequence[i - 1])
            handle.publish_feedback(Fibonacci.Feedback(np.array(sequence, np.int32)))
            yield from rate.sleep()
        handle.succeed()
        return result(*sequence)

    ActionServer(node, Fibonacci, "fib", execute, lambda goal: goal.order > 0)
    fib = ActionClient(bus.create_node("fib_client"), Fibonacci, "fib")
    times: list[float] = []
    (bad,) = send(fib, -1)
    good = fib.send_goal(Fibonacci.Goal(5), lambda f: times.append(clock.now_ns / SECOND))
    while not good.done:
        bus.spin()
        clock.now_ns += SECOND // 10
        if len(times) == 1 and clock.now_ns > 60 * SECOND:
            raise AssertionError("not done")
    assert bad.accepted is False
    assert good.result.sequence.tolist() == [0, 1, 1, 2, 3, 5]
    assert np.diff(times) == pytest.approx(1.0)
    (cancelled,) = send(fib, 100)
    spin(bus, 3)
    cancelled.cancel()
    clock.now_ns += SECOND
    spin(bus, 3)
    assert states([cancelled]) == ["CANCELED"]
