from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from twin.bridge import action_types, srvs, types
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import JointState, Quaternion, Time, Twist, duration, new, ns, stamp
from twin.errors import BridgeError

PUBLISHED = Path(__file__).parents[4] / "shared/data/rihs01_published.json"


def _published() -> dict[str, str]:
    if not PUBLISHED.exists():
        return {}
    return {k: v for k, v in json.loads(PUBLISHED.read_text()).items() if k != "note"}


@pytest.mark.skipif(not PUBLISHED.exists(), reason=f"{PUBLISHED.name} is not here")
def test_hashes_equal_those_in_files_that_ros_generated() -> None:
    types.register(
        "myroboticarm_msgs/action/Fibonacci",
        "int32 order\n---\nint32[] sequence\n---\nint32[] partial_sequence\n",
    )
    published = _published()
    assert {name: types.rihs01(name) for name in published} == {
        name: f"RIHS01_{value}" for name, value in published.items()
    }


OTHER = json.loads((Path(__file__).parents[1] / "data" / "rihs01_other.json").read_text("utf-8"))
TEST_MSGS = Path(__file__).parents[1] / "data" / "test_msgs"


@pytest.mark.parametrize("source", [source for source in OTHER if source != "note"])
def test_hashes_equal_those_that_rosidl_wrote_elsewhere(source: str) -> None:
    types.add_folder(TEST_MSGS)  # every feature of .msg files: rosidl's own test package
    wrong = [name for name, value in OTHER[source].items() if types.rihs01(name) != f"RIHS01_{value}"]
    assert wrong == []


def test_hashes_in_use_on_every_action() -> None:
    # facts/wire.md, from the ROS files
    assert types.rihs01("action_msgs/srv/CancelGoal").startswith("RIHS01_573d8b0a")
    assert types.rihs01("action_msgs/msg/GoalStatusArray").startswith("RIHS01_6c1684b0")


def _shipped() -> list[str]:
    root = resources.files("twin.bridge") / "interfaces"
    return [
        f"{package.name}/{kind.name}/{file.name.partition('.')[0]}"
        for package in root.iterdir()
        for kind in package.iterdir()
        for file in kind.iterdir()
    ]


@pytest.mark.parametrize("name", sorted(_shipped()))
def test_every_shipped_definition_is_usable(name: str) -> None:
    assert types.rihs01(name).startswith("RIHS01_")
    suffixes = {"msg": [""], "srv": ["_Request", "_Response"], "action": ["_Goal", "_Result", "_Feedback"]}
    for suffix in suffixes[types.parts(name).kind]:
        cls = types.get(name + suffix)
        one = codec(cls)
        assert one.encode(one.decode(one.encode(new(cls)))) == one.encode(new(cls))


def test_a_misspelt_type_names_the_nearest() -> None:
    with pytest.raises(BridgeError, match="did you mean 'nav2_msgs/action/NavigateToPose'"):
        types.get("nav2_msgs/action/NavigateToPse")
    with pytest.raises(BridgeError, match="did you mean 'geometry_msgs/msg/Twist'"):
        types.get("geometry_msgs/Twits")
    with pytest.raises(BridgeError, match="did you mean 'nav2_msgs'"):
        types.get("nav2_msg/msg/Costmap")
    with pytest.raises(BridgeError, match="not a type name"):
        types.get("Twist")


def test_a_registered_type_keeps_its_definition() -> None:
    types.register("test_msgs/msg/Twice", "int8 a")
    types.register("test_msgs/msg/Twice", "int8 a")
    with pytest.raises(BridgeError, match="already known"):
        types.register("test_msgs/msg/Twice", "int16 a")


def test_an_unparsable_definition_is_an_error_of_the_user() -> None:
    with pytest.raises(BridgeError, match="test_msgs/msg/Broken, line 1"):
        types.register("test_msgs/msg/Broken", "this is = no definition [")
    with pytest.raises(BridgeError, match="not known"):
        types.get("test_msgs/msg/Broken")


def test_defaults_are_those_of_the_definition() -> None:
    assert new(Quaternion) == Quaternion(0.0, 0.0, 0.0, 1.0)
    goal = new(action_types.DockRobot.Goal, dock_id="home")
    assert (goal.use_dock_id, goal.max_staging_time, goal.dock_id) == (True, 1000.0, "home")
    state = new(JointState)
    assert state.position.dtype == np.float64
    assert state.position.size == 0
    assert new(Twist).linear is not new(Twist).linear
    with pytest.raises(TypeError):
        new(Twist, speed=1.0)


def test_an_empty_request_needs_no_arguments() -> None:
    assert codec(srvs.Trigger.Request).encode(srvs.Trigger.Request()) == bytes.fromhex("0001000000")


def test_time_is_exact() -> None:
    assert ns(stamp(1_234_567_890_123_456_789)) == 1_234_567_890_123_456_789
    assert stamp(2_000_000_001) == Time(2, 1)
    assert ns(duration(-1)) == -1


def test_a_service_is_no_message() -> None:
    with pytest.raises(BridgeError, match="no message"):
        types.get("std_srvs/srv/SetBool")
    with pytest.raises(BridgeError, match="no part"):
        types.get("std_srvs/srv/SetBool_Goal")
