"""What is made when it is first used is what rosbags makes at once."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys import store as rosbags_store

from twin.bridge import types
from twin.bridge.actions.server import ActionServer
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import general_codec
from twin.bridge.msgs import DiagnosticStatus, Float64MultiArray, KeyValue, Time, Twist, Vector3, new
from twin.bridge.types import ActionType, ServiceType, lazy_store
from twin.errors import BridgeError

WHOLE = get_typestore(Stores.ROS2_JAZZY)
MESSAGES = [
    DiagnosticStatus(2, "a", "bc", "def", [KeyValue("key", "value")]),
    new(Twist, linear=Vector3(1.0, -2.0, 3.0)),
    new(Float64MultiArray, data=np.arange(5.0)),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.__msgtype__)
def test_its_functions_are_those_of_rosbags(message: Any) -> None:
    name = message.__msgtype__
    for little in (True, False):
        payload = bytes(WHOLE.serialize_cdr(message, name, little_endian=little))
        assert bytes(types.store.serialize_cdr(message, name, little_endian=little)) == payload
        ours, theirs = (store.deserialize_cdr(payload, name) for store in (types.store, WHOLE))
        assert repr(ours) == repr(theirs) == repr(message)
    ros1 = bytes(WHOLE.serialize_ros1(message, name))
    assert bytes(types.store.serialize_ros1(message, name)) == ros1
    assert bytes(types.store.ros1_to_cdr(ros1, name)) == bytes(WHOLE.ros1_to_cdr(ros1, name))
    assert repr(types.store.deserialize_ros1(ros1, name)) == repr(WHOLE.deserialize_ros1(ros1, name))


def test_its_classes_are_those_of_rosbags() -> None:
    types.register("test_msgs/msg/Lazy", "int32 FEW=3\nfloat64[] values\nstring from\nTime stamp\n")
    types.register("test_msgs/msg/Time", "int32 t")
    made = types.get("test_msgs/msg/Lazy")
    eager = get_typestore(Stores.EMPTY)
    eager.register({"test_msgs/msg/Lazy": types.definitions("test_msgs/msg/Lazy")["test_msgs/msg/Lazy"]})
    other = eager.types["test_msgs/msg/Lazy"]
    assert made is types.get("test_msgs/msg/Lazy")
    arguments = (np.zeros(2), "here", Time(1, 2))
    assert repr(made(*arguments)) == repr(other(*arguments))
    assert (made.FEW, made.__annotations__) == (3, other.__annotations__)
    assert copy.deepcopy(made(None, "a", None)) == made(None, "a", None)


def test_fields_that_python_cannot_tell_apart_are_an_error_of_the_user() -> None:
    field = types.definitions("std_msgs/msg/Bool")["std_msgs/msg/Bool"][1][0][1]
    with pytest.raises(BridgeError, match=r"test_msgs/msg/Apart cannot be used: .*'from' and 'from_'"):
        types.add_definitions({"test_msgs/msg/Apart": ([], [("from", field), ("from_", field)])}, {})


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is generated from now on: functions of codecs, code of classes."""
    found: list[str] = []

    def counted(kind: str, generate: Callable[..., Any]) -> Callable[..., Any]:
        def generated(*arguments: Any, **more: Any) -> Any:
            found.append(kind)
            return generate(*arguments, **more)

        return generated

    for module in (lazy_store, rosbags_store):
        for name in [name for name in vars(module) if name.startswith("generate_")]:
            kind = name.removeprefix("generate_")
            monkeypatch.setattr(module, name, counted(kind, getattr(module, name)))
    return found


def test_only_what_is_sent_or_received_needs_code(bus: Bus, made: list[str]) -> None:
    types.register("test_msgs/msg/Quiet", "float64 a\nfloat64 b")
    types.register("test_msgs/srv/Quiet", "int32 a\n---\nint32 b")
    types.register("test_msgs/action/Quiet", "int32 a\n---\nint32 b\n---\nint32 c")
    cls = types.get("test_msgs/msg/Quiet")
    made.clear()
    node = bus.create_node("n")
    publisher = node.create_publisher(cls, "topic")
    service = ServiceType("test_msgs/srv/Quiet")
    node.create_service(service, "service", lambda request: service.Response(request.a + 1))
    client = node.create_client(service, "service")
    ActionServer(node, ActionType("test_msgs/action/Quiet"), "action", lambda handle: iter(()))
    publisher.publish(cls(1.0, 2.0))
    assert made == []
    heard: list[Any] = []
    node.create_subscription(cls, "topic", heard.append)
    publisher.publish(cls(1.0, 2.0))
    assert sorted(made) == ["getsize_cdr", "serialize_cdr"]
    bus.spin()
    assert heard == [cls(1.0, 2.0)]
    made.clear()
    future = client.call_async(service.Request(4))
    bus.spin()
    bus.spin()
    assert future.result.b == 5
    once = ["deserialize_cdr", "getsize_cdr", "python_code", "serialize_cdr"]
    assert sorted(made) == sorted(2 * once)  # of the request and of the response
    made.clear()
    general_codec(cls).decode(general_codec(cls).encode(cls(1.0, 2.0)))
    assert made == []
