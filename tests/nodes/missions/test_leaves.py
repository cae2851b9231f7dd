"""CallAction and CallService on real action servers and services."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

from tests.nodes.conftest import Bench
from twin.bridge.action_types import Wait
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.msgs import GoalStatus, duration, new
from twin.bridge.srvs import AddTwoInts
from twin.navigation.behavior_trees.node import Status
from twin.nodes.missions.leaves import CallAction, CallService, Condition, Do, sequence, with_recovery


class Server:
    """Serves `wait`: ends after as many ticks as the goal has nanoseconds; 13 ns is refused, 7 ns fails."""

    def __init__(self, bench: Bench) -> None:
        self.log: list[str] = []
        node = bench.bus.create_node("server")
        ActionServer(node, Wait, "wait", self.execute, lambda goal: goal.time.nanosec != 13)

    def execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        ticks = handle.request.time.nanosec
        self.log.append(f"start {ticks}")
        try:
            for _ in range(ticks):
                if handle.is_cancel_requested:
                    handle.canceled()
                    self.log.append(f"cancel {ticks}")
                    return new(Wait.Result, error_msg="canceled")
                yield
            if ticks == 7:
                handle.abort()
                return new(Wait.Result, error_msg="seven is unlucky")
            self.log.append(f"end {ticks}")
            return new(Wait.Result, total_elapsed_time=duration(ticks))
        except GeneratorExit:
            self.log.append(f"preempted {ticks}")
            raise


def goal(ticks: int) -> Any:
    return new(Wait.Goal, time=duration(ticks))


@pytest.fixture
def server(bench: Bench) -> Server:
    return Server(bench)


@pytest.fixture
def client(bench: Bench, server: Server) -> ActionClient:
    return ActionClient(bench.node, Wait, "wait")


def finish(bench: Bench, leaf: Any, ticks: int = 40) -> Status:
    for _ in range(ticks):
        leaf.execute_tick()
        if leaf.status != Status.RUNNING:
            break
        bench.tick()
    return leaf.status


def test_success_hands_the_result_over(bench: Bench, client: ActionClient) -> None:
    got: list[int] = []
    leaf = CallAction(
        "leaf", client, lambda: goal(5), on_result=lambda r: got.append(r.total_elapsed_time.nanosec)
    )
    leaf.execute_tick()
    assert leaf.status == Status.RUNNING
    assert finish(bench, leaf) == Status.SUCCESS
    assert got == [5]


def test_a_result_may_be_judged_a_failure(bench: Bench, client: ActionClient) -> None:
    said: list[str] = []
    leaf = CallAction(
        "Close", client, lambda: goal(5), on_result=lambda _: "closed on nothing", on_failure=said.append
    )
    assert finish(bench, leaf) == Status.FAILURE
    assert said == ["Close: closed on nothing"]


def test_an_aborted_goal_fails_with_the_servers_reason(bench: Bench, client: ActionClient) -> None:
    said: list[str] = []
    leaf = CallAction("Wait", client, lambda: goal(7), on_failure=said.append)
    assert finish(bench, leaf) == Status.FAILURE
    assert said == ["Wait: seven is unlucky"]


def test_a_rejected_goal_fails_and_says_so(bench: Bench, client: ActionClient, server: Server) -> None:
    said: list[str] = []
    leaf = CallAction("Wait", client, lambda: goal(13), on_failure=said.append)
    assert finish(bench, leaf) == Status.FAILURE
    assert said == ["Wait: the action /wait rejected the goal"]
    assert server.log == []


def test_without_a_server_the_leaf_fails_and_says_so(bench: Bench) -> None:
    said: list[str] = []
    lonely = ActionClient(bench.node, Wait, "nobody")
    assert (
        finish(bench, CallAction("Wait", lonely, lambda: goal(1), on_failure=said.append)) == Status.FAILURE
    )
    assert "/nobody" in said[0]
    assert "rejected" not in said[0]


def test_a_goal_that_cannot_be_made_is_not_sent(bench: Bench, client: ActionClient, server: Server) -> None:
    assert finish(bench, CallAction("leaf", client, lambda: None)) == Status.FAILURE
    bench.run(0.2)
    assert server.log == []


def test_a_halt_cancels_the_goal_at_the_server(bench: Bench, client: ActionClient, server: Server) -> None:
    leaf = CallAction("leaf", client, lambda: goal(100))
    finish(bench, leaf, ticks=5)
    assert leaf.status == Status.RUNNING
    leaf.reset()
    bench.run(0.2)
    assert server.log == ["start 100", "cancel 100"]


def test_a_halted_leaf_sends_a_new_goal_at_its_next_start(
    bench: Bench, client: ActionClient, server: Server
) -> None:
    leaf = CallAction("leaf", client, lambda: goal(3))
    leaf.execute_tick()
    leaf.reset()
    assert finish(bench, leaf) == Status.SUCCESS
    assert server.log[-1] == "end 3"


def test_a_late_result_of_a_halted_goal_does_not_count(bench: Bench, client: ActionClient) -> None:
    ticks = iter([2, 50])
    leaf = CallAction("leaf", client, lambda: goal(next(ticks)))
    finish(bench, leaf, ticks=2)
    leaf.reset()
    assert finish(bench, leaf, ticks=20) == Status.RUNNING


def test_the_status_at_the_client_is_cancelled(bench: Bench, client: ActionClient, server: Server) -> None:
    sent = client.send_goal(goal(100))
    bench.run(0.1)
    sent.cancel()
    bench.run(0.1)
    assert sent.status == GoalStatus.STATUS_CANCELED


def test_call_service_waits_and_judges_the_answer(bench: Bench) -> None:
    bench.bus.create_node("adder").create_service(
        AddTwoInts, "add", lambda request: AddTwoInts.Response(request.a + request.b)
    )
    caller = bench.node.create_client(AddTwoInts, "add")
    request = AddTwoInts.Request(20, 22)
    assert finish(bench, CallService("add", caller, lambda: request)) == Status.SUCCESS
    right = CallService("add", caller, lambda: request, lambda response: response.sum == 42)
    wrong = CallService("add", caller, lambda: request, lambda response: response.sum == 43)
    assert (finish(bench, right), finish(bench, wrong)) == (Status.SUCCESS, Status.FAILURE)


def test_call_service_without_a_service_fails(bench: Bench) -> None:
    caller = bench.node.create_client(AddTwoInts, "nobody")
    assert finish(bench, CallService("add", caller, lambda: AddTwoInts.Request(1, 2))) == Status.FAILURE


def test_condition_and_do() -> None:
    assert finish_once(Condition("c", lambda: True)) == Status.SUCCESS
    assert finish_once(Condition("c", lambda: False)) == Status.FAILURE
    failed = Do("d", lambda: "no such place")
    assert finish_once(Do("d", lambda: None)) == Status.SUCCESS
    assert finish_once(failed) == Status.FAILURE
    assert failed.reason == "no such place"


def finish_once(leaf: Any) -> Status:
    leaf.execute_tick()
    return leaf.status


def test_a_recovery_lets_a_sequence_begin_anew_so_many_times() -> None:
    log: list[str] = []
    results = iter(["no", "no", None])

    def grasp() -> str | None:
        log.append("grasp")
        return next(results)

    def leaf(name: str) -> Do:
        return Do(name, lambda: log.append(name))

    pick = sequence("pick", [leaf("dock"), Do("grasp", grasp)])
    tree = with_recovery("retry", 2, pick, leaf("undock"))
    assert tree.execute_tick() is Status.SUCCESS
    assert log == ["dock", "grasp", "undock", "dock", "grasp", "undock", "dock", "grasp"]
    assert (
        with_recovery("retry", 2, Do("never", lambda: "no"), leaf("undock")).execute_tick() is Status.FAILURE
    )


def test_halting_a_tree_cancels_what_runs_in_it(bench: Bench, client: ActionClient, server: Server) -> None:
    tree = sequence("s", [Do("d", lambda: None), CallAction("Wait", client, lambda: goal(100))])
    finish(bench, tree, ticks=5)
    tree.reset()
    bench.run(0.2)
    assert server.log == ["start 100", "cancel 100"]
