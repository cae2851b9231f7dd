"""Nodes spin only when something has come or is due; all of them in every spin is the oracle."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Empty
from twin.bridge.wire.session import SessionConfig
from twin.savings import ALL

Log = Callable[[str], None]


def timers(bus: Bus, log: Log) -> None:
    """One node cancels and resets another one's timers, and gives it a new one."""
    first, second = bus.create_node("first"), bus.create_node("second")
    slow = second.create_timer(70, lambda: log("slow"))
    idle = second.create_timer(30, lambda: log("idle"), autostart=False)

    def change() -> None:
        if bus.clock.now_ns == 100:
            slow.cancel()
            idle.reset()
        elif bus.clock.now_ns == 200:
            first.create_timer(20, lambda: log("late"))
            slow.reset()

    first.create_timer(50, change)


def tasks(bus: Bus, log: Log) -> None:
    """Tasks wait for spins, times and messages; one node gives another one a task."""
    first, second = bus.create_node("first"), bus.create_node("second")
    publisher = bus.create_node("third").create_publisher(Empty, "go")
    heard: list[Empty] = []

    def work() -> Generator[int | None, None, None]:
        start_ns = bus.clock.now_ns
        for _ in range(3):
            yield None
            log("spun")
        while not heard and bus.clock.now_ns < start_ns + 500:
            yield start_ns + 500
        log("heard" if heard else "waited")
        yield from second.create_rate(1e7).sleep()
        log("slept")

    second.create_subscription(Empty, "go", heard.append)
    first.create_timer(130, lambda: second.create_task(work()))
    first.create_timer(700, lambda: publisher.publish(Empty()))
    first.create_timer(900, heard.clear)


def actions(bus: Bus, log: Log) -> None:
    """Goals that wait for a time, for a cancel, for another node; results that expire."""
    server, client = bus.create_node("server"), bus.create_node("client")
    accepted: list[GoalHandle] = []

    def execute(handle: GoalHandle) -> Generator[int, None, Any]:
        end_ns = bus.clock.now_ns + 10 * handle.request.order
        while bus.clock.now_ns < end_ns:
            if handle.is_cancel_requested:
                handle.canceled()
                break
            yield end_ns
        log(f"executed {handle.request.order}")
        return Fibonacci.Result(np.zeros(0, np.int32))

    ActionServer(
        server, Fibonacci, "fibonacci", execute, policy="queue",
        handle_accepted_callback=accepted.append, result_timeout_ns=300,
    )  # fmt: skip
    user = ActionClient(client, Fibonacci, "fibonacci")
    goals = [user.send_goal(Fibonacci.Goal(order)) for order in (7, 30, 2, 1)]

    def ask() -> None:
        for goal in goals:
            answer = user.get_result(goal.goal_id)
            answer.add_done_callback(lambda future: log(future.error or f"status {future.result.status}"))

    events: dict[int, Callable[[], Any]] = {  # by another node than the server's
        100: lambda: accepted[0].execute(),
        120: lambda: accepted[1].execute(),
        310: goals[1].cancel,
        400: lambda: accepted[2].execute(),
        640: ask,
        960: goals[3].cancel,
        1000: lambda: accepted[3].canceled(),
        1400: ask,
    }
    client.create_timer(10, lambda: events.pop(bus.clock.now_ns, lambda: None)())


def run(scene: Callable[[Bus, Log], None], *, due: bool) -> list[tuple[int, str]]:
    clock, events = Clock(), list[tuple[int, str]]()
    with Bus.of(SessionConfig(name="twin"), clock, savings=replace(ALL, due=due)) as bus:
        scene(bus, lambda what: events.append((clock.now_ns, what)))
        for now_ns in (*range(0, 1500, 10), *range(400, 700, 10)):  # the clock is set back once
            clock.now_ns = now_ns
            bus.spin()
    return events


@pytest.mark.parametrize("scene", [timers, tasks, actions])
def test_whoever_has_nothing_to_do_is_not_missed(scene: Callable[[Bus, Log], None]) -> None:
    events = run(scene, due=True)
    assert len(events) > 10
    assert events == run(scene, due=False)


def test_a_task_that_waits_for_a_time_goes_on_then_or_when_its_node_spins(bus: Bus, clock: Clock) -> None:
    node, awake = bus.create_node("a"), list[int]()
    node.create_subscription(Empty, "go", lambda _: None)
    publisher = node.create_publisher(Empty, "go")

    def work() -> Generator[int, None, None]:
        while True:
            awake.append(clock.now_ns)
            yield 60

    node.create_task(work())
    for now_ns in range(0, 80, 10):
        clock.now_ns = now_ns
        if now_ns == 30:
            publisher.publish(Empty())
        bus.spin()
    assert awake == [0, 30, 60, 70]


def test_an_idle_action_server_lets_its_process_sleep(bus: Bus) -> None:
    node = bus.create_node("a")
    ActionServer(node, Fibonacci, "fibonacci", lambda handle: (yield))
    bus.spin()
    assert node.wait_ns is None
