"""What is made when it is first used is what rosbags makes at once."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from twin.bridge import types
from twin.bridge.actions.server import ActionServer
from twin.bridge.bus import Bus
from twin.bridge.cdr.decoder import decoder
from twin.bridge.cdr.encoder import encoder
from twin.bridge.msgs import Time
from twin.bridge.types import ActionType, ServiceType, lazy_store
from twin.errors import BridgeError


def test_its_classes_have_the_fields_and_constants_of_those_of_rosbags() -> None:
    types.register("test_msgs/msg/Lazy", "int32 FEW=3\nfloat64[] values\nstring from\nTime stamp\n")
    types.register("test_msgs/msg/Time", "int32 t")
    made = types.get("test_msgs/msg/Lazy")
    eager = get_typestore(Stores.EMPTY)
    eager.register({"test_msgs/msg/Lazy": types.definitions("test_msgs/msg/Lazy")["test_msgs/msg/Lazy"]})
    other = eager.types["test_msgs/msg/Lazy"]
    assert made is types.get("test_msgs/msg/Lazy")
    assert (made.__name__, made.__msgtype__, made.FEW) == (other.__name__, other.__msgtype__, other.FEW)
    values, stamp = np.zeros(2), Time(1, 2)
    message, its = made(values, "here", stamp=stamp), other(values, "here", stamp=stamp)
    assert (message.values, message.from_, message.stamp) == (its.values, its.from_, its.stamp)
    assert repr(made(1, "a", 2)) == "test_msgs__msg__Lazy(values=1, from_='a', stamp=2)"
    assert copy.deepcopy(made(None, "a", None)) == made(None, "a", None) != made(None, "b", None)


def test_a_field_that_a_message_does_not_have_cannot_be_set() -> None:
    with pytest.raises(AttributeError, match="nsec"):
        Time(1, 2).nsec = 3  # type: ignore[attr-defined]


def test_fields_that_python_cannot_tell_apart_are_an_error_of_the_user() -> None:
    field = types.definitions("std_msgs/msg/Bool")["std_msgs/msg/Bool"][1][0][1]
    with pytest.raises(BridgeError, match=r"test_msgs/msg/Apart cannot be used: .*'from' and 'from_'"):
        types.add_definitions({"test_msgs/msg/Apart": ([], [("from", field), ("from_", field)])}, {})


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Callable[[], Counter[str]]:
    """Return a function that tells what was generated since it was last asked."""
    found = Counter[str]()
    make = lazy_store.make_dataclass

    def making(*arguments: Any, **options: Any) -> type:
        found["class"] += 1
        return make(*arguments, **options)

    monkeypatch.setattr(lazy_store, "make_dataclass", making)

    def tell() -> Counter[str]:
        now = found + Counter(encoder=encoder.cache_info().misses, decoder=decoder.cache_info().misses)
        told, tell.before = now - tell.before, now  # type: ignore[attr-defined]
        return told

    tell.before = Counter[str]()  # type: ignore[attr-defined]
    return tell


def test_only_what_is_sent_or_received_needs_code(bus: Bus, made: Callable[[], Counter[str]]) -> None:
    types.register("test_msgs/msg/Quiet", "float64 a\nfloat64 b")
    types.register("test_msgs/srv/Quiet", "int32 a\n---\nint32 b")
    types.register("test_msgs/action/Quiet", "int32 a\n---\nint32 b\n---\nint32 c")
    cls = types.get("test_msgs/msg/Quiet")
    made()
    node = bus.create_node("n")
    publisher = node.create_publisher(cls, "topic")
    service = ServiceType("test_msgs/srv/Quiet")
    node.create_service(service, "service", lambda request: service.Response(request.a + 1))
    client = node.create_client(service, "service")
    ActionServer(node, ActionType("test_msgs/action/Quiet"), "action", lambda handle: iter(()))
    publisher.publish(cls(1.0, 2.0))
    assert not made()
    heard: list[Any] = []
    node.create_subscription(cls, "topic", heard.append)
    publisher.publish(cls(1.0, 2.0))
    bus.spin()
    assert heard == [cls(1.0, 2.0)]
    made()
    future = client.call_async(service.Request(4))
    bus.spin()
    bus.spin()
    assert future.result.b == 5
    once = Counter(["class", "encoder", "decoder"])
    assert made() == once + once  # of the request and of the response
