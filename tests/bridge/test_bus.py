from __future__ import annotations

import hashlib
import threading

import numpy as np
import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import LaserScan, String, Twist, new
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.topics import Sample
from twin.errors import BridgeError


def test_a_message_arrives_in_the_receivers_spin_as_its_own_copy(bus: Bus) -> None:
    sender, receiver = bus.create_node("sender"), bus.create_node("receiver")
    got: list[Twist] = []
    receiver.create_subscription(Twist, "cmd_vel", got.append)
    twist = new(Twist)
    twist.linear.x = 0.3
    sender.create_publisher(Twist, "/cmd_vel").publish(twist)
    assert got == []
    receiver.spin()
    assert got == [twist]
    assert got[0] is not twist


def test_arrays_survive(bus: Bus) -> None:
    node = bus.create_node("laser")
    got: list[LaserScan] = []
    node.create_subscription(LaserScan, "scan", got.append)
    ranges = np.linspace(0.1, 8.0, 360, dtype=np.float32)
    node.create_publisher(LaserScan, "scan").publish(new(LaserScan, ranges=ranges))
    bus.spin()
    np.testing.assert_array_equal(got[0].ranges, ranges)


def test_spin_order_is_inbox_then_timers_then_executions_node_by_node(bus: Bus, clock: Clock) -> None:
    log: list[str] = []

    class Execution:
        due_ns = 0

        def step(self) -> None:
            log.append("execution")

        def close(self) -> None:
            pass

    first, second = bus.create_node("first"), bus.create_node("second")
    second.create_subscription(String, "x", lambda m: log.append(f"second {m.data}"))
    first.add_execution(Execution())
    first.create_timer(10, lambda: log.append("timer"))
    first.create_subscription(String, "x", lambda m: log.append(f"first {m.data}"))
    publisher = second.create_publisher(String, "x")
    publisher.publish(String("a"))
    publisher.publish(String("b"))
    clock.now_ns = 10
    bus.spin()
    assert log == ["first a", "first b", "timer", "execution", "second a", "second b"]


def test_what_a_callback_publishes_to_itself_waits_for_the_next_spin(bus: Bus) -> None:
    node = bus.create_node("echo")
    publisher = node.create_publisher(String, "x")
    got: list[str] = []

    def on_message(message: String) -> None:
        got.append(message.data)
        publisher.publish(String(message.data + "!"))

    node.create_subscription(String, "x", on_message)
    publisher.publish(String("hi"))
    bus.spin()
    assert got == ["hi"]
    bus.spin()
    assert got == ["hi", "hi!"]


def _run(seed: int) -> tuple[str, list[str]]:
    """Three chatting nodes; return the digest of all samples and the order of callbacks."""
    clock, digest, order = Clock(), hashlib.sha256(), []

    def tap(sample: Sample[String]) -> None:
        digest.update(f"{sample.topic} {sample.msgtype} {sample.time_ns}".encode() + sample.payload)

    with Bus.open(clock) as bus:
        bus.tap(tap)
        for index in range(3):
            node = bus.create_node(f"node{index}")
            publisher = node.create_publisher(String, f"topic{index}")
            node.create_timer(
                7 * (index + 1), lambda p=publisher, i=index: p.publish(String(f"{i} {clock.now_ns} {seed}"))
            )
            for other in range(3):
                node.create_subscription(
                    String, f"topic{other}", lambda m, i=index: order.append(f"{i} heard {m.data}")
                )
        for _ in range(50):
            clock.now_ns += 5
            bus.admit()
            bus.spin()
    return digest.hexdigest(), order


def test_the_same_run_twice_is_the_same_run() -> None:
    first, second = _run(1), _run(1)
    assert first == second
    assert len(first[1]) > 100
    assert _run(2) != first


def test_gids_depend_on_names_only() -> None:
    def gid() -> bytes:
        with Bus.open(Clock()) as bus:
            return bus.create_node("a").create_publisher(String, "x").gid

    assert gid() == gid()


def test_a_tap_sees_what_nobody_subscribes_to(bus: Bus, clock: Clock) -> None:
    clock.now_ns = 42
    samples: list[Sample[Twist]] = []
    bus.tap(samples.append)
    bus.create_node("a", "robot").create_publisher(Twist, "cmd_vel").publish(new(Twist))
    (sample,) = samples
    assert (sample.topic, sample.msgtype, sample.time_ns) == ("/robot/cmd_vel", "geometry_msgs/msg/Twist", 42)
    assert sample.payload == b"\0\1\0\0" + bytes(48)


def test_nothing_is_encoded_when_nobody_listens(bus: Bus, monkeypatch: pytest.MonkeyPatch) -> None:
    node = bus.create_node("a")
    publisher = node.create_publisher(String, "x")
    broken = String(data=3)  # type: ignore[arg-type]  # cannot be encoded
    publisher.publish(broken)
    node.create_subscription(String, "x", lambda m: None)
    with pytest.raises(Exception, match="encode"):
        publisher.publish(broken)


def test_transient_local_serves_who_comes_later(bus: Bus) -> None:
    node = bus.create_node("map_server")
    publisher = node.create_publisher(String, "map", LATCHED)
    publisher.publish(String("old"))
    publisher.publish(String("new"))
    got: list[str] = []
    late = bus.create_node("late")
    late.create_subscription(String, "map", lambda m: got.append(m.data), LATCHED)
    late.create_subscription(String, "map", lambda m: got.append(f"volatile {m.data}"))
    bus.spin()
    assert got == ["new"]
    publisher.publish(String("newer"))
    bus.spin()
    assert got == ["new", "newer", "volatile newer"]


def test_a_subscription_keeps_the_last_depth_messages(bus: Bus) -> None:
    node = bus.create_node("a")
    got: list[str] = []
    subscription = node.create_subscription(String, "x", lambda m: got.append(m.data), QoS(depth=2))
    publisher = node.create_publisher(String, "x")
    for text in "abcd":
        publisher.publish(String(text))
    bus.spin()
    assert got == ["c", "d"]
    assert subscription.dropped == 2
    publisher.publish(String("e"))
    bus.spin()
    assert got == ["c", "d", "e"]


def test_a_subscription_does_not_deliver_what_outlived_its_lifespan(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("a")
    got: list[str] = []
    qos = QoS(depth=2, lifespan_ns=100)
    subscription = node.create_subscription(String, "x", lambda m: got.append(m.data), qos)
    publisher = node.create_publisher(String, "x")
    for time_ns, text in ((0, "pushed out"), (99, "too old"), (100, "old enough")):
        clock.now_ns = time_ns
        publisher.publish(String(text))
    clock.now_ns = 200
    bus.spin()
    assert got == ["old enough"]
    assert subscription.dropped == 2


def test_a_message_of_another_type_is_refused(bus: Bus) -> None:
    publisher = bus.create_node("a").create_publisher(Twist, "cmd_vel")
    with pytest.raises(TypeError, match="cmd_vel carries geometry_msgs/msg/Twist"):
        publisher.publish(String("faster"))  # type: ignore[arg-type]


def test_an_exception_in_a_callback_is_not_swallowed(bus: Bus) -> None:
    node = bus.create_node("a")
    node.create_subscription(String, "x", lambda m: 1 / 0)
    node.create_publisher(String, "x").publish(String(""))
    with pytest.raises(ZeroDivisionError):
        bus.spin()


def test_a_put_from_another_thread_waits_for_admit_and_is_sorted(bus: Bus) -> None:
    node = bus.create_node("a")
    got: list[str] = []
    node.create_subscription(String, "x", lambda m: got.append(m.data))
    node.create_subscription(String, "b", lambda m: got.append(m.data))
    x, b = node.create_publisher(String, "x"), node.create_publisher(String, "b")
    thread = threading.Thread(
        target=lambda: [p.publish(String(t)) for p, t in ((x, "x1"), (b, "b1"), (x, "x2"))]
    )
    thread.start()
    thread.join()
    bus.spin()
    assert got == []
    assert bus.admit() == 3
    bus.spin()
    assert got == ["b1", "x1", "x2"]


def test_a_flood_drops_the_oldest_and_is_reported_once(bus: Bus, caplog: pytest.LogCaptureFixture) -> None:
    bus.external = type(bus.external)(depth=3)
    node = bus.create_node("a")
    got: list[str] = []
    node.create_subscription(String, "x", lambda m: got.append(m.data))
    publisher = node.create_publisher(String, "x")
    thread = threading.Thread(target=lambda: [publisher.publish(String(str(i))) for i in range(8)])
    thread.start()
    thread.join()
    bus.admit()
    bus.spin()
    assert got == ["5", "6", "7"]
    assert bus.refused == {"overflow": 5}
    assert [r.message for r in caplog.records if "/x" in r.message] == [
        "/x: a message from outside was dropped (overflow: more than 3 samples in one tick); reported once"
    ]


def test_node_names_are_unique(bus: Bus) -> None:
    bus.create_node("amcl", "r1")
    bus.create_node("amcl", "r2")
    with pytest.raises(BridgeError, match="/r1/amcl"):
        bus.create_node("amcl", "/r1/")


def test_a_destroyed_node_hears_nothing_and_its_name_is_free(bus: Bus) -> None:
    node = bus.create_node("a")
    got: list[String] = []
    node.create_subscription(String, "x", got.append)
    publisher = bus.create_node("b").create_publisher(String, "x")
    publisher.publish(String("late"))
    node.destroy()
    node.destroy()
    publisher.publish(String("later"))
    bus.spin()
    assert got == []
    bus.create_node("a")


def test_close_twice(clock: Clock) -> None:
    bus = Bus.open(clock)
    bus.create_node("a")
    bus.close()
    bus.close()
