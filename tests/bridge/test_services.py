from __future__ import annotations

from typing import Any

import pytest

from twin.bridge.bus import Bus
from twin.bridge.services import Respond
from twin.bridge.srvs import AddTwoInts, Trigger
from twin.errors import BridgeError


def test_a_request_is_answered_in_the_servers_spin(bus: Bus) -> None:
    server, client_node = bus.create_node("server", "r"), bus.create_node("client")
    server.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response(request.a + request.b))
    client = client_node.create_client(AddTwoInts, "/r/add")
    assert client.service_is_ready
    future = client.call_async(AddTwoInts.Request(2, 3))
    client_node.spin()
    assert not future.done
    with pytest.raises(BridgeError, match="not answered yet"):
        _ = future.result
    server.spin()
    assert not future.done
    client_node.spin()
    assert future.done
    assert future.result.sum == 5


def test_answers_go_to_who_asked(bus: Bus) -> None:
    node = bus.create_node("server")
    node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response(request.a + request.b))
    clients = [bus.create_node(f"c{i}").create_client(AddTwoInts, "add") for i in range(3)]
    futures = [c.call_async(AddTwoInts.Request(i, 10 * k)) for k in range(3) for i, c in enumerate(clients)]
    bus.spin()
    assert [f.result.sum for f in futures] == [i + 10 * k for k in range(3) for i in range(3)]


def test_a_response_may_come_later(bus: Bus) -> None:
    waiting: list[Respond] = []

    def later(request: Any, respond: Respond) -> None:
        waiting.append(respond)

    bus.create_node("server").create_deferred_service(Trigger, "go", later)
    future = bus.create_node("client").create_client(Trigger, "go").call_async(Trigger.Request())
    done: list[bool] = []
    future.add_done_callback(lambda f: done.append(f.result.success))
    for _ in range(3):
        bus.spin()
    assert not future.done
    waiting.pop()(Trigger.Response(True, ""))
    bus.spin()
    assert future.done
    assert done == [True]


def test_nobody_answers(bus: Bus) -> None:
    client = bus.create_node("client").create_client(Trigger, "/nowhere")
    assert not client.service_is_ready
    future = client.call_async(Trigger.Request())
    bus.spin()
    assert future.done
    with pytest.raises(BridgeError, match="nobody answered on the service /nowhere"):
        _ = future.result


def test_a_request_of_another_type_is_refused(bus: Bus) -> None:
    client = bus.create_node("client").create_client(Trigger, "go")
    with pytest.raises(TypeError, match="Trigger_Request"):
        client.call_async(AddTwoInts.Request(1, 2))


def test_an_exception_in_a_service_is_not_swallowed(bus: Bus) -> None:
    bus.create_node("server").create_service(Trigger, "go", lambda request: 1 / 0)
    bus.create_node("client").create_client(Trigger, "go").call_async(Trigger.Request())
    with pytest.raises(ZeroDivisionError):
        bus.spin()
