"""Timers, rates, tasks, logs, and what is destroyed when."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Log, String
from twin.bridge.node import Node
from twin.bridge.node.options import NodeOptions
from twin.bridge.qos import QoS
from twin.bridge.types import ServiceType
from twin.errors import BridgeError
from twin.periods import period_of

SECOND = 1_000_000_000


def test_a_timer_tells_when_it_is_due(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("a")
    timer = node.create_timer(20, lambda: None, autostart=False)
    assert timer.is_canceled
    assert timer.time_until_next_call is None
    assert node.wait_ns is None
    clock.now_ns = 25
    timer.reset()
    assert (timer.time_until_next_call, timer.is_ready, node.wait_ns) == (15, False, 15)
    clock.now_ns = 41
    assert (timer.time_until_next_call, timer.is_ready) == (-1, True)
    bus.spin()
    assert (timer.last_ns, timer.is_ready) == (41, False)
    assert node.destroy_timer(timer)
    assert not node.destroy_timer(timer)


def test_timers_go_on_when_the_clock_is_set_back(bus: Bus, clock: Clock) -> None:
    fired: list[int] = []
    bus.create_node("a").create_timer(20, lambda: fired.append(clock.now_ns))
    for now_ns in (20, 1000, 0, 10, 20, 40):
        clock.now_ns = now_ns
        bus.spin()
    assert fired == [20, 1000, 20, 40]


def test_a_rate_sleeps_to_the_next_multiple(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("a")
    rate = node.create_rate(10.0)
    awake: list[int] = []

    def work() -> Generator[None, None, None]:
        while True:
            yield from rate.sleep()
            awake.append(clock.now_ns)

    task = node.create_task(work())
    for step in range(31):
        clock.now_ns = step * SECOND // 100
        bus.spin()
    assert awake == [SECOND // 10, SECOND // 5, 3 * SECOND // 10]
    task.cancel()
    bus.spin()
    assert task.done
    with pytest.raises(BridgeError, match="rate of 0 Hz"):
        node.create_rate(0)


def test_a_timer_of_30_hz_keeps_its_mean_rate(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("a")
    fired: list[int] = []
    awake: list[int] = []
    rate = node.create_rate(30.0)

    def work() -> Generator[None, None, None]:
        while True:
            yield from rate.sleep()
            awake.append(clock.now_ns)

    node.create_timer(period_of(30.0), lambda: fired.append(clock.now_ns))
    node.create_task(work())
    ticks = [k * SECOND // 50 for k in range(50 * 100 + 1)]
    for clock.now_ns in ticks:
        bus.spin()
    due = [-(-k * SECOND // 30) for k in range(1, 3001)]
    assert len(fired) == 3000
    assert all(0 <= time - at < SECOND // 50 for time, at in zip(fired, due, strict=True)), "the first tick"
    assert awake == fired


def test_an_exception_in_a_task_is_not_swallowed(bus: Bus) -> None:
    def work() -> Generator[None, None, None]:
        yield
        raise ZeroDivisionError

    bus.create_node("a").create_task(work())
    bus.spin()
    with pytest.raises(ZeroDivisionError):
        bus.spin()


def _destroyers(node: Node) -> dict[str, Any]:
    def task() -> Generator[None, None, None]:
        node.destroy()
        yield

    return {
        "timer": lambda: node.create_timer(1, node.destroy),
        "message": lambda: node.create_subscription(String, "x", lambda message: node.destroy()),
        "task": lambda: node.create_task(task()),
    }


@pytest.mark.parametrize("where", ["timer", "message", "task"])
def test_a_node_may_destroy_itself_in_its_callbacks(bus: Bus, clock: Clock, where: str) -> None:
    node, other = bus.create_node("a"), bus.create_node("b")
    heard: list[str] = []
    node.create_subscription(String, "x", lambda message: heard.append(message.data))
    _destroyers(node)[where]()
    node.create_timer(1, lambda: heard.append("timer"))
    publisher = other.create_publisher(String, "x")
    publisher.publish(String("1"))
    publisher.publish(String("2"))
    clock.now_ns = 1
    for _ in range(3):
        bus.spin()
    assert node.is_destroyed
    assert heard == {"timer": ["1", "2"], "message": ["1"], "task": ["1", "2", "timer"]}[where]
    node.destroy()
    with pytest.raises(BridgeError, match="the node /a is destroyed"):
        node.create_publisher(String, "y")
    assert bus.nodes == (other,)


def test_endpoints_are_destroyed_one_by_one(bus: Bus) -> None:
    node, heard = bus.create_node("a"), []
    publisher = node.create_publisher(String, "x")
    subscription = node.create_subscription(String, "x", lambda message: heard.append(message.data))
    publisher.publish(String("dropped"))
    assert node.destroy_subscription(subscription)
    bus.spin()
    assert heard == []
    assert not publisher.has_subscribers
    assert not bus.create_node("b").destroy_publisher(publisher)
    assert node.destroy_publisher(publisher)
    with pytest.raises(BridgeError, match="the publisher of /x is destroyed"):
        publisher.publish(String(""))


@pytest.fixture
def heard(bus: Bus) -> list[Log]:
    got: list[Log] = []
    qos = QoS(depth=1000, durability="transient_local")
    bus.create_node("console").create_subscription(Log, "/rosout", got.append, qos)
    return got


def test_filters_count_per_place(bus: Bus, clock: Clock, heard: list[Log]) -> None:
    log = bus.create_node("n").get_logger()
    for step in range(5):
        clock.now_ns = step * SECOND
        log.info(f"once {step}", once=True)
        log.info(f"skip {step}", skip_first=True)
        log.warn(f"throttle {step}", throttle_duration_sec=2.0)
        log.fatal(f"both {step}", once=True, skip_first=True)
    bus.spin()
    texts = [m.msg for m in heard]
    assert [t for t in texts if t.startswith("once")] == ["once 0"]
    assert [t for t in texts if t.startswith("skip")] == ["skip 1", "skip 2", "skip 3", "skip 4"]
    assert [t for t in texts if t.startswith("throttle")] == ["throttle 0", "throttle 2", "throttle 4"]
    assert [(m.msg, m.level) for m in heard if m.level == Log.FATAL] == [("both 1", 50)]
    assert {(m.file, m.function, m.line) for m in heard} == {("", "", 0)}


def test_levels_are_inherited_and_set_from_outside(bus: Bus, heard: list[Log]) -> None:
    node = bus.create_node("n", "r", options=NodeOptions(enable_logger_service=True))
    log = node.get_logger()
    child = log.get_child("planner")
    assert not child.debug("unheard")
    getting, setting = (ServiceType(f"rcl_interfaces/srv/{kind}LoggerLevels") for kind in ("Get", "Set"))
    level = types.get("rcl_interfaces/msg/LoggerLevel")
    asker = bus.create_node("asker")
    changed = asker.create_client(setting, "/r/n/set_logger_levels").call_async(
        setting.Request([level("r.n", Log.DEBUG), level("r.n.planner", Log.ERROR), level("x", 7)])
    )
    told = asker.create_client(getting, "/r/n/get_logger_levels").call_async(
        getting.Request(["r.n", "r.n.planner", "r.n.other"])
    )
    for _ in range(2):
        bus.spin()
    assert [(r.successful, r.reason) for r in changed.result.results] == [
        (True, ""),
        (True, ""),
        (False, "Failed reason: Invalid logger level."),
    ]
    assert [entry.level for entry in told.result.levels] == [Log.DEBUG, Log.ERROR, 0]
    assert log.debug("heard")
    assert not child.warning("unheard")
    assert log.get_child("other").debug("heard too")
    bus.spin()
    assert [(m.name, m.msg) for m in heard] == [("r.n", "heard"), ("r.n.other", "heard too")]


def test_a_node_sees_the_graph(bus: Bus) -> None:
    node, other = bus.create_node("a", "r"), bus.create_node("b")
    for owner in (node, other):
        owner.create_publisher(String, "/x")
    other.create_subscription(String, "/x", print)
    assert (node.count_publishers("/x"), node.count_subscribers("/x"), node.count_publishers("x")) == (
        2,
        1,
        0,
    )
    assert sorted(node.get_node_names_and_namespaces()) == [("a", "/r"), ("b", "/")]
    assert node.get_topic_names_and_types() == [("/x", ["std_msgs/msg/String"])]
    other.destroy()
    assert node.get_node_names() == ["a"]
    assert node.get_service_names_and_types() == []
