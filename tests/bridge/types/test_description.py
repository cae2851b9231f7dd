from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from twin.bridge import types
from twin.bridge.cdr.codec import codec
from twin.bridge.types.default_values import new
from twin.bridge.types.description import TypeDescription, describe, learn, sources
from twin.errors import BridgeError

ACTION = """geometry_msgs/PoseStamped target
string<=5[<=3] names
---
byte[4] raw
int8[2] pair [1, -2]
string[] words ["a, b", "c"]
bool on true
string say 'hi'
---
float32 part
"""


@pytest.mark.parametrize(
    "name",
    [
        "nav_msgs/msg/Odometry",
        "std_srvs/srv/SetBool",
        "nav2_msgs/action/NavigateToPose",
        "std_msgs/msg/Empty",
    ],
)
def test_a_known_type_survives_its_description(name: str) -> None:
    description = describe(name)
    travels = codec(TypeDescription)
    received = travels.decode(travels.encode(description))
    assert received.type_description.type_name == name
    assert learn(received, types.rihs01(name)) == name


def renamed(description: Any, old: str, new: str) -> Any:
    for item in (description.type_description, *description.referenced_type_descriptions):
        item.type_name = item.type_name.replace(old, new)
        for field in item.fields:
            field.type.nested_type_name = field.type.nested_type_name.replace(old, new)
    return description


def test_an_unknown_type_is_learned_with_all_that_it_uses() -> None:
    types.register("origin_msgs/action/Reach", ACTION)
    types.register("other_msgs/action/Reach", ACTION)
    description = renamed(describe("origin_msgs/action/Reach"), "origin_msgs", "learned_msgs")
    assert learn(description) == "learned_msgs/action/Reach"
    goal = types.get("learned_msgs/action/Reach_Goal")
    assert list(goal.__annotations__)[:2] == ["target", "names"]
    result = new(types.get("learned_msgs/action/Reach_Result"))
    assert (result.pair.tolist(), result.words, result.on, result.say) == ([1, -2], ["a, b", "c"], True, "hi")
    wanted = renamed(describe("other_msgs/action/Reach"), "other_msgs", "learned_msgs")
    assert describe("learned_msgs/action/Reach") == wanted
    learn(describe("learned_msgs/action/Reach"), types.rihs01("learned_msgs/action/Reach"))


def test_another_hash_is_refused() -> None:
    description = renamed(describe("std_srvs/srv/SetBool"), "std_srvs", "refused_srvs")
    with pytest.raises(BridgeError, match="has the hash"):
        learn(description, "RIHS01_" + "0" * 64)
    with pytest.raises(BridgeError, match="not known"):
        types.get("refused_srvs/srv/SetBool_Request")


def test_other_fields_under_a_known_name_are_refused() -> None:
    description = describe("geometry_msgs/msg/Point")
    description.type_description.fields[0].name = "w"
    with pytest.raises(BridgeError, match="geometry_msgs/msg/Point is already known with other fields"):
        learn(description)


FAULTS = ["missing", "number", "name", "no fields", "field name", "loop", "huge", "default"]


@pytest.mark.parametrize("fault", FAULTS)
def test_nonsense_is_refused_and_leaves_nothing(fault: str) -> None:
    description = renamed(describe("geometry_msgs/msg/Pose"), "geometry_msgs", "nonsense_msgs")
    own = description.type_description
    match fault:
        case "missing":
            del description.referenced_type_descriptions[0]
        case "number":
            own.fields[0].type.type_id = 12
        case "name":
            own.type_name = "no name"
        case "no fields":
            own.fields.clear()
        case "field name":
            own.fields[0].name = "x: int\n    y"
        case "loop":
            own.fields[0].type.nested_type_name = own.type_name
        case "default":
            own.fields[0].default_value = "__import__('os')"
        case "huge":
            own.fields[0].type.type_id, own.fields[0].type.capacity = 51, 2**60
    with pytest.raises(BridgeError):
        learn(description)
    assert not any("nonsense_msgs" in name for name in types.names())


def test_defaults_are_written_as_rosidl_writes_them() -> None:
    types.add_folder(Path(__file__).parents[1] / "data" / "test_msgs")
    fields = {
        field.name: field.default_value for field in describe("test_msgs/msg/Arrays").type_description.fields
    }
    assert fields["bool_values_default"] == "(False, True, False)"
    assert fields["byte_values_default"] == "(0, 1, 255)"
    assert fields["string_values_default"] == "('', 'max value', 'min value')"
    assert fields["bool_values"] == ""
    (w,) = [
        field for field in describe("geometry_msgs/Quaternion").type_description.fields if field.name == "w"
    ]
    assert w.default_value == "1.0"


def test_sources_hold_the_texts() -> None:
    found = {source.type_name: source for source in sources("std_srvs/srv/SetBool")}
    assert found["std_srvs/srv/SetBool"].encoding == "srv"
    assert "bool data" in found["std_srvs/srv/SetBool"].raw_file_contents
    assert found["std_srvs/srv/SetBool_Request"].encoding == "implicit"
    assert found["builtin_interfaces/msg/Time"].raw_file_contents == "int32 sec\nuint32 nanosec\n"
