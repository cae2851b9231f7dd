from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import ParameterDescriptor, ParameterEvent, SetParametersResult
from twin.bridge.node import Node
from twin.bridge.node.options import NodeOptions
from twin.bridge.node.services import GetTypeDescription
from twin.bridge.parameters.errors import (
    InvalidParameterValueException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from twin.bridge.parameters.values import Parameter, Type, value_to_python
from twin.bridge.srvs import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

IntegerRange = types.get("rcl_interfaces/msg/IntegerRange")
FloatingPointRange = types.get("rcl_interfaces/msg/FloatingPointRange")

BUILT_IN = ["use_sim_time", "start_type_description_service"]
VALUES = {
    Type.BOOL: True,
    Type.INTEGER: -(2**63),
    Type.DOUBLE: 0.5,
    Type.STRING: "ü",
    Type.BYTE_ARRAY: [b"\x00", b"\xff"],
    Type.BOOL_ARRAY: [True, False],
    Type.INTEGER_ARRAY: [1, 2],
    Type.DOUBLE_ARRAY: [1.0, 2.5],
    Type.STRING_ARRAY: ["a", ""],
}


def ask(bus: Bus, service: Any, name: str, *request: Any) -> Any:
    client = bus.create_node(f"asker_{len(bus.nodes)}").create_client(service, name)
    future = client.call_async(service.Request(*request))
    for _ in range(3):
        bus.spin()
    return future.result


def events_of(bus: Bus) -> list[ParameterEvent]:
    seen: list[ParameterEvent] = []
    bus.create_node("watch").create_subscription(ParameterEvent, "/parameter_events", seen.append, 1000)
    return seen


def test_every_type_survives_the_wire(bus: Bus) -> None:
    node = bus.create_node("n")
    for kind, value in VALUES.items():
        node.declare_parameter(kind.name.lower(), value)
        assert node.get_parameter_type(kind.name.lower()) is kind
    names = [kind.name.lower() for kind in VALUES]
    values = ask(bus, GetParameters, "/n/get_parameters", names).values
    assert [(Type(v.type), value_to_python(v)) for v in values] == list(VALUES.items())
    kinds = ask(bus, GetParameterTypes, "/n/get_parameter_types", names).types
    assert kinds.tolist() == [kind.value for kind in VALUES]


@pytest.mark.parametrize(
    "value",
    [2**63, [1, 2.0], {"a": 1}, [[1]], object(), [b"ab"], [True, 1]],
    ids=lambda value: str(type(value)),
)
def test_other_values_are_refused(bus: Bus, value: Any) -> None:
    with pytest.raises(BridgeError, match=r"the parameter x cannot be|the parameter x is a byte array"):
        bus.create_node("n").declare_parameter("x", value)


def test_numpy_values_and_tuples_become_plain(bus: Bus) -> None:
    node = bus.create_node("n")
    assert node.declare_parameter("a", np.float64(1.5)).value == 1.5
    assert node.declare_parameter("b", np.arange(2)).value == [0, 1]
    assert node.declare_parameter("c", (1.0, 2.0)).value == [1.0, 2.0]
    assert node.declare_parameter("d", b"ab").value == [b"a", b"b"]


@pytest.mark.parametrize(
    ("value", "fits"), [(0, True), (10, True), (4, True), (5, False), (-1, False), (11, False)]
)
def test_integer_ranges(bus: Bus, value: int, fits: bool) -> None:
    node = bus.create_node("n")
    node.declare_parameter("x", 0, new(ParameterDescriptor, integer_range=[IntegerRange(0, 10, 4)]))
    (result,) = node.set_parameters([Parameter("x", value=value)])
    assert result.successful == fits
    if value == 11:
        assert result.reason == "Parameter x out of range. Min: 0, Max: 10, value: 11"
    if value == 5:
        assert "is not a valid step" in result.reason


@pytest.mark.parametrize(
    ("value", "fits"),
    [(0.0, True), (1.0, True), (0.3, True), (0.30000001, True), (0.35, False), (1.01, False)],
)
def test_floating_point_ranges(bus: Bus, value: float, fits: bool) -> None:
    node = bus.create_node("n")
    node.declare_parameter(
        "x", 1.0, new(ParameterDescriptor, floating_point_range=[FloatingPointRange(0.0, 1.0, 0.1)])
    )
    assert node.set_parameters([Parameter("x", value=value)])[0].successful == fits
    with pytest.raises(InvalidParameterValueException, match=r"out of range Min: 0.0, Max: 1.0, value: 2.0"):
        node.set_parameter("x", 2.0)


def test_static_dynamic_and_uninitialised_parameters(bus: Bus) -> None:
    node = bus.create_node("n")
    node.declare_parameter("static", 1)
    node.declare_parameter("dynamic", 1, new(ParameterDescriptor, dynamic_typing=True))
    node.declare_parameter("later", Parameter.Type.STRING)
    text = [Parameter("static", value="a"), Parameter("dynamic", value="a"), Parameter("later", value="a")]
    with pytest.raises(ParameterUninitializedException):
        node.get_parameter("later")
    assert node.get_parameter_or("later", Parameter("later", value="b")).value == "b"
    results = node.set_parameters(text)
    assert [r.successful for r in results] == [False, True, True]
    assert results[0].reason == "Wrong parameter type, expected 'Type.INTEGER' got 'Type.STRING'"
    assert node.set_parameters([Parameter("static")])[0].reason == "Static parameter cannot be undeclared"
    assert node.set_parameters([Parameter("dynamic")])[0].successful
    assert not node.has_parameter("dynamic")
    with pytest.raises(BridgeError, match="without a value"):
        node.declare_parameter("none")


def test_read_only_parameters_only_start_with_another_value(bus: Bus) -> None:
    node = bus.create_node("n", parameters={"frame": "map"})
    node.declare_parameter("frame", "odom", new(ParameterDescriptor, read_only=True))
    assert node.get_parameter("frame").value == "map"
    (result,) = node.set_parameters([Parameter("frame", value="base")])
    assert (result.successful, result.reason) == (False, "Trying to set a read-only parameter: frame.")
    with pytest.raises(ParameterImmutableException):
        node.undeclare_parameter("frame")


def test_all_or_none(bus: Bus) -> None:
    node = bus.create_node("n")
    node.declare_parameters("gain", [("p", 1.0), ("i", 0.0), ("d", 0.0)])
    changes = [Parameter("gain.p", value=2.0), Parameter("gain.i", value="much")]
    assert not node.set_parameters_atomically(changes).successful
    assert {k: p.value for k, p in node.get_parameters_by_prefix("gain").items()} == {
        "p": 1.0,
        "i": 0.0,
        "d": 0.0,
    }
    assert [r.successful for r in node.set_parameters(changes)] == [True, False]
    with pytest.raises(ParameterNotDeclaredException, match=r"did you mean 'gain\.p'"):
        node.set_parameters([Parameter("gain.q", value=1.0)])


def test_callbacks_are_asked_and_told_in_rclpys_order(bus: Bus) -> None:
    node = bus.create_node("n")
    node.declare_parameter("a", 1)
    node.declare_parameter("b", 1)
    log: list[str] = []

    def pre(parameters: list[Parameter]) -> list[Parameter]:
        log.append("pre")
        return [*parameters, Parameter("b", value=parameters[0].value * 10)]

    def on(parameters: list[Parameter]) -> SetParametersResult:
        log.append("on " + ", ".join(f"{p.name}={p.value}" for p in parameters))
        return SetParametersResult(parameters[0].value < 5, "a is below 5")

    node.add_pre_set_parameters_callback(pre)
    node.add_on_set_parameters_callback(on)
    node.add_post_set_parameters_callback(
        lambda parameters: log.append(f"post {node.get_parameter('b').value}")
    )
    assert node.set_parameters_atomically([Parameter("a", value=2)]).successful
    assert node.set_parameters_atomically([Parameter("a", value=7)]).reason == "a is below 5"
    assert log == ["pre", "on a=2, b=20", "post 20", "pre", "on a=7, b=70"]
    assert node.get_parameter("a").value == 2
    node.remove_on_set_parameters_callback(on)
    node.remove_pre_set_parameters_callback(pre)
    node.add_pre_set_parameters_callback(lambda parameters: [])
    assert "cannot be empty" in node.set_parameters_atomically([Parameter("a", value=3)]).reason


def test_a_new_descriptor_must_fit(bus: Bus) -> None:
    node = bus.create_node("n")
    node.declare_parameter("x", 5)
    narrow = new(ParameterDescriptor, type=2, integer_range=[IntegerRange(0, 3, 0)])
    with pytest.raises(InvalidParameterValueException):
        node.set_descriptor("x", narrow)
    assert node.get_parameter("x").value == 5
    assert node.set_descriptor("x", narrow, 2).value == 2
    assert node.describe_parameter("x").integer_range == [IntegerRange(0, 3, 0)]


def test_what_is_declared_together_is_described_when_somebody_asks(bus: Bus) -> None:
    node = bus.create_node("n", options=NodeOptions(allow_undeclared_parameters=True))
    asked: list[str] = []

    def describe(name: str) -> str:
        asked.append(name)
        return f"What {name} is."

    descriptor = new(ParameterDescriptor, additional_constraints="must be small")
    node.declare_together([(name, 1, descriptor) for name in "xyz"], describe)
    assert asked == []
    told = node.describe_parameter("x")
    assert (told.name, told.description, told.additional_constraints) == ("x", "What x is.", "must be small")
    node.set_descriptor("y", new(ParameterDescriptor, type=2, description="Another."))
    node.undeclare_parameter("z")
    node.declare_parameter("z", 1, new(ParameterDescriptor, description="New."))
    node.set_parameter("x", 2)
    told_later = [one.description for one in node.describe_parameters("xyz")]
    assert told_later == ["What x is.", "Another.", "New."]
    assert set(asked) == {"x"}


def test_parameter_events_tell_what_is_new_changed_and_gone(bus: Bus, clock: Clock) -> None:
    seen = events_of(bus)
    node = bus.create_node("n", "r", options=NodeOptions(allow_undeclared_parameters=True))
    clock.now_ns = 2_000_000_000
    node.declare_parameter("a", 1)
    node.set_parameters([Parameter("a", value=2), Parameter("free", value="x"), Parameter("free")])
    node.set_parameters([Parameter("a", value="no")])
    bus.spin()
    kinds = [
        [[p.name for p in part] for part in (e.new_parameters, e.changed_parameters, e.deleted_parameters)]
        for e in seen
    ]
    assert kinds == [[["a"], [], []], [[], ["a"], []], [["free"], [], []], [[], [], ["free"]]]
    assert {(e.node, e.stamp.sec) for e in seen} == {("/r/n", 2)}


@pytest.fixture
def amcl(bus: Bus) -> Node:
    node = bus.create_node("amcl")
    node.declare_parameter("frame", "map", new(ParameterDescriptor, read_only=True, description="of the map"))
    node.declare_parameters("laser", [("range", 5.0), ("beams.max", 60)])
    return node


def test_the_services_answer_as_rclpys_do(bus: Bus, amcl: Node) -> None:
    def setting(*parameters: Parameter) -> list[tuple[bool, str]]:
        messages = [p.to_parameter_msg() for p in parameters]
        return [
            (r.successful, r.reason)
            for r in ask(bus, SetParameters, "/amcl/set_parameters", messages).results
        ]

    assert setting(Parameter("laser.range", value=7.0), Parameter("laser.range", value=8)) == [
        (True, ""),
        (False, "Wrong parameter type, expected 'Type.DOUBLE' got 'Type.INTEGER'"),
    ]
    assert setting(Parameter("frame", value="odom"), Parameter("nope", value=1)) == [
        (False, "Trying to set a read-only parameter: frame."),
        (False, "Invalid access to undeclared parameter(s): ['nope']"),
    ]
    assert amcl.get_parameter("laser.range").value == 7.0
    both = [Parameter("laser.range", value=1.0), Parameter("frame", value="odom")]
    messages = [p.to_parameter_msg() for p in both]
    result = ask(bus, SetParametersAtomically, "/amcl/set_parameters_atomically", messages).result
    assert (result.successful, amcl.get_parameter("laser.range").value) == (False, 7.0)
    unknown = ["laser.range", "nope"]
    assert ask(bus, GetParameters, "/amcl/get_parameters", unknown).values == []
    assert ask(bus, GetParameterTypes, "/amcl/get_parameter_types", unknown).types.size == 0
    assert ask(bus, DescribeParameters, "/amcl/describe_parameters", unknown).descriptors == []
    (descriptor,) = ask(bus, DescribeParameters, "/amcl/describe_parameters", ["frame"]).descriptors
    assert (descriptor.name, descriptor.type, descriptor.description) == ("frame", 4, "of the map")


@pytest.mark.parametrize(
    ("prefixes", "depth", "names", "parents"),
    [
        ([], 0, [*BUILT_IN, "frame", "laser.range", "laser.beams.max"], ["laser", "laser.beams"]),
        ([], 1, [*BUILT_IN, "frame"], []),
        ([], 2, [*BUILT_IN, "frame", "laser.range"], ["laser"]),
        (["laser"], 0, ["laser.range", "laser.beams.max"], ["laser", "laser.beams"]),
        (["laser"], 1, ["laser.range"], ["laser"]),
        (["frame", "las"], 0, ["frame"], []),
    ],
)
def test_list_parameters(
    bus: Bus, amcl: Node, prefixes: list[str], depth: int, names: list[str], parents: list[str]
) -> None:
    result = ask(bus, ListParameters, "/amcl/list_parameters", prefixes, depth).result
    assert (result.names, result.prefixes) == (names, parents)


def test_a_type_from_outside_that_does_not_exist_is_refused(bus: Bus, amcl: Node) -> None:
    message = Parameter("laser.range", value=1.0).to_parameter_msg()
    message.value.type = 77
    (result,) = ask(bus, SetParameters, "/amcl/set_parameters", [message]).results
    assert (result.successful, "77" in result.reason) == (False, True)


def test_time_is_the_process_s_and_nobody_changes_that(bus: Bus) -> None:
    node = bus.create_node("n", parameters={"use_sim_time": False})
    assert node.get_parameter("use_sim_time").value is True
    assert not node.set_parameters([Parameter("use_sim_time", value=False)])[0].successful


def test_without_a_network_services_appear_with_the_first_client(bus: Bus) -> None:
    client = bus.create_node("asker").create_client(ListParameters, "/later/list_parameters")
    assert not client.service_is_ready
    bus.create_node("later")
    assert client.service_is_ready
    bus.create_node("closed", options=NodeOptions(start_parameter_services=False))
    assert not bus.create_node("b").create_client(ListParameters, "/closed/list_parameters").service_is_ready


def test_overrides_may_declare_themselves(bus: Bus) -> None:
    options = NodeOptions(automatically_declare_parameters_from_overrides=True)
    node = bus.create_node("n", parameters={"a.b": 1, "c": [True]}, options=options)
    assert [node.get_parameter(name).value for name in ("a.b", "c")] == [1, [True]]


def test_an_empty_list_takes_the_declared_type(bus: Bus) -> None:
    node = bus.create_node("n", parameters={"plugins": []})
    assert node.declare_parameter("plugins", ["a"]).type_ is Type.STRING_ARRAY
    assert node.set_parameter("plugins", []).value == []
    empty = Parameter("p", Type.DOUBLE_ARRAY, [])
    assert empty.get_parameter_value().double_array_value.size == 0


def test_a_node_describes_types(bus: Bus) -> None:
    bus.create_node("n")
    name = "geometry_msgs/msg/Twist"
    answer = ask(bus, GetTypeDescription, "/n/get_type_description", name, types.rihs01(name), True)
    assert answer.successful
    assert answer.type_description.type_description.type_name == name
    assert [t.type_name for t in answer.type_description.referenced_type_descriptions] == [
        "geometry_msgs/msg/Vector3"
    ]
    assert len(answer.type_sources) == 2
    for wrong in ((name, "RIHS01_00", False), ("no_msgs/msg/None", "RIHS01_00", False), (name, "md5", False)):
        answer = ask(bus, GetTypeDescription, "/n/get_type_description", *wrong)
        assert (answer.successful, bool(answer.failure_reason)) == (False, True)
