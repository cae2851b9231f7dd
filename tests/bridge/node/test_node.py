from __future__ import annotations

import logging

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import Log, String
from twin.bridge.names import Resolver, expand
from twin.bridge.parameters.parameters import Parameter
from twin.bridge.qos import LATCHED, QoS
from twin.errors import BridgeError


@pytest.mark.parametrize(
    ("name", "full"), [("scan", "/r/scan"), ("/scan", "/scan"), ("~/scan", "/r/amcl/scan"), ("a/b", "/r/a/b")]
)
def test_names_are_expanded_as_in_ros(name: str, full: str) -> None:
    assert expand(name, "/r", "amcl") == full


@pytest.mark.parametrize("name", ["", "/", "1scan", "a//b", "a/", "sc an", "*", "~scan", "a/*/b", "ü"])
def test_invalid_names_are_refused(bus: Bus, name: str) -> None:
    with pytest.raises(BridgeError, match="valid"):
        bus.create_node("a").create_publisher(String, name)


def test_invalid_node_names_are_refused(bus: Bus) -> None:
    with pytest.raises(BridgeError, match="node name"):
        bus.create_node("a/b")
    with pytest.raises(BridgeError, match="namespace"):
        bus.create_node("a", "r 1")


def test_remappings_apply_after_expansion() -> None:
    resolver = Resolver("/r", "n", {"cmd_vel": "cmd_vel_nav", "/tf": "tf"})
    assert resolver.resolve("cmd_vel") == "/r/cmd_vel_nav"
    assert resolver.resolve("/r/cmd_vel") == "/r/cmd_vel_nav"
    assert resolver.resolve("/cmd_vel") == "/cmd_vel"
    assert resolver.resolve("/tf") == "/r/tf"


def test_two_robots_in_two_namespaces_do_not_hear_each_other(bus: Bus) -> None:
    got: dict[str, list[str]] = {"r1": [], "r2": []}
    for robot, log in got.items():
        bus.create_node("base", robot).create_subscription(
            String, "cmd", lambda m, log=log: log.append(m.data)
        )
    bus.create_node("teleop", "r2").create_publisher(String, "cmd").publish(String("go"))
    bus.spin()
    assert got == {"r1": [], "r2": ["go"]}


def test_a_timer_fires_at_multiples_of_its_period(bus: Bus, clock: Clock) -> None:
    node, fired = bus.create_node("a"), []
    clock.now_ns = 25
    timer = node.create_timer(20, lambda: fired.append(clock.now_ns))
    for now_ns in range(25, 101, 5):
        clock.now_ns = now_ns
        bus.spin()
    assert fired == [40, 60, 80, 100]
    clock.now_ns = 200
    bus.spin()
    bus.spin()
    assert fired == [40, 60, 80, 100, 200]
    timer.cancel()
    clock.now_ns = 300
    bus.spin()
    assert fired[-1] == 200
    with pytest.raises(BridgeError, match="period"):
        node.create_timer(0, lambda: None)


def test_parameters(bus: Bus) -> None:
    node = bus.create_node("amcl", parameters={"alpha1": 1, "max_particles": 500})
    assert node.declare_parameter("alpha1", 0.2).value == 1.0
    assert isinstance(node.get_parameter("alpha1").value, float)
    assert node.declare_parameter("min_particles", 100).value == 100
    assert [p.value for p in node.get_parameters(["alpha1", "min_particles"])] == [1.0, 100]
    with pytest.raises(BridgeError, match="did you mean 'alpha1'"):
        node.get_parameter("alpha")
    with pytest.raises(BridgeError, match="twice"):
        node.declare_parameter("alpha1", 0.2)
    with pytest.raises(BridgeError, match=r"max_particles of /amcl is a string; 500 is a int"):
        node.declare_parameter("max_particles", "many")
    with pytest.raises(BridgeError, match="is a integer; True is a bool"):
        node.set_parameter("min_particles", True)


def test_a_node_may_refuse_a_parameter(bus: Bus) -> None:
    node = bus.create_node("amcl")
    node.declare_parameter("rate", 10.0)

    def check(parameters: list[Parameter]) -> None:
        if parameters[0].value <= 0.0:
            raise BridgeError("rate must be positive")

    node.add_on_set_parameters_callback(check)
    with pytest.raises(BridgeError, match="positive"):
        node.set_parameter("rate", -1.0)
    assert node.get_parameter("rate").value == 10.0
    assert node.set_parameter("rate", 5.0).value == node.get_parameter("rate").value == 5.0


def test_the_log_goes_to_rosout_and_to_pythons_logging(
    bus: Bus, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    clock.now_ns = 1_500_000_000
    log = bus.create_node("amcl", "r1").get_logger()
    for now_ns in (1_500_000_000, 2_400_000_000, 2_500_000_000):
        clock.now_ns = now_ns
        log.warn("lost", throttle_duration_sec=1.0)
    log.debug("details")
    log.error("gone")
    got: list[Log] = []
    late = bus.create_node("console")
    late.create_subscription(Log, "/rosout", got.append, QoS(depth=1000, durability="transient_local"))
    bus.spin()
    assert [(m.stamp.sec, m.level, m.name, m.msg) for m in got] == [
        (1, Log.WARN, "r1.amcl", "lost"),
        (2, Log.WARN, "r1.amcl", "lost"),
        (2, Log.ERROR, "r1.amcl", "gone"),
    ]
    assert [r.message for r in caplog.records if r.name == "twin.amcl"] == ["lost", "lost", "gone"]


def test_qos_depth_must_be_positive() -> None:
    with pytest.raises(ValueError, match="depth"):
        QoS(depth=0)
    assert LATCHED.depth == 1
