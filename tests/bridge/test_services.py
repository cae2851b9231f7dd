from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from typing import Any

import pytest
import zenoh

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.services import Respond
from twin.bridge.srvs import AddTwoInts, Trigger
from twin.bridge.wire.session import SessionConfig
from twin.errors import BridgeError
from twin.savings import ALL


@pytest.fixture(params=[True, False], ids=["in process", "through Zenoh"])
def bus(request: pytest.FixtureRequest, clock: Clock) -> Iterator[Bus]:
    savings = replace(ALL, services_in_process=request.param)
    with Bus.of(SessionConfig(name="twin"), clock, savings=savings) as opened:
        yield opened


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


def test_a_service_answers_once_and_with_its_type(bus: Bus) -> None:
    kept: list[Respond] = []
    bus.create_node("server").create_deferred_service(
        Trigger, "go", lambda request, respond: kept.append(respond)
    )
    future = bus.create_node("client").create_client(Trigger, "go").call_async(Trigger.Request())
    bus.spin()
    with pytest.raises(TypeError, match="go answers with std_srvs/srv/Trigger_Response"):
        kept[0](AddTwoInts.Response(1))
    kept[0](Trigger.Response(True, ""))
    with pytest.raises(BridgeError, match="answered twice"):
        kept[0](Trigger.Response(True, ""))
    bus.spin()
    assert future.result.success


@pytest.mark.parametrize("handled", [True, False])
def test_a_service_destroyed_meanwhile_leaves_nobody_waiting(bus: Bus, handled: bool) -> None:
    kept: list[Respond] = []
    server = bus.create_node("server")
    service = server.create_deferred_service(Trigger, "go", lambda request, respond: kept.append(respond))
    future = bus.create_node("client").create_client(Trigger, "go").call_async(Trigger.Request())
    if handled:
        server.spin()
    assert server.destroy_service(service)
    assert not server.destroy_service(service)
    if handled:
        kept[0](Trigger.Response(True, ""))  # too late, and no harm
    bus.spin()
    assert future.error == "nobody answered on the service /go; is its node running?"


def test_a_client_destroyed_meanwhile_ends_its_futures(bus: Bus) -> None:
    bus.create_node("server").create_service(Trigger, "go", lambda request: Trigger.Response(True, ""))
    node = bus.create_node("client")
    client = node.create_client(Trigger, "go")
    future = client.call_async(Trigger.Request())
    node.destroy_client(client)
    bus.spin()
    assert future.error == "the client of /go was destroyed before an answer came"
    with pytest.raises(BridgeError, match="is destroyed"):
        client.call_async(Trigger.Request())


def test_a_request_may_be_forgotten_or_cancelled(bus: Bus) -> None:
    bus.create_node("server").create_service(Trigger, "go", lambda request: Trigger.Response(True, ""))
    client = bus.create_node("client").create_client(Trigger, "go")
    forgotten, cancelled = client.call_async(Trigger.Request()), client.call_async(Trigger.Request())
    client.remove_pending_request(forgotten)
    cancelled.cancel()
    bus.spin()
    assert not forgotten.done
    assert cancelled.error == "the request to /go was cancelled"


def test_a_task_waits_for_a_service_and_its_answer(bus: Bus, clock: Clock) -> None:
    node = bus.create_node("client")
    client = node.create_client(AddTwoInts, "add")

    def ask() -> Generator[None, None, Any]:
        early = yield from client.wait_for_service(timeout_ns=10)
        ready = yield from client.wait_for_service()
        response = yield from client.call_async(AddTwoInts.Request(1, 2))
        return early, ready, response.sum

    task = node.create_task(ask())
    for _ in range(30):
        bus.spin()
        clock.now_ns += 1
    assert not task.done
    bus.create_node("server").create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
    for _ in range(4):
        bus.spin()
    assert task.done
    assert task.result == (False, True, 3)


def test_services_of_one_name_are_all_asked_and_the_first_answer_counts(bus: Bus) -> None:
    asked: list[Any] = []
    for name in ("mute", "talking"):
        bus.create_node(name).create_deferred_service(Trigger, "go", lambda _, respond: asked.append(respond))
    client = bus.create_node("client").create_client(Trigger, "go")
    futures = [client.call_async(Trigger.Request()) for _ in range(2)]
    bus.spin()
    assert len(asked) == 4
    asked[2](Trigger.Response(True, ""))
    bus.nodes[0].destroy()
    bus.spin()
    assert [future.done for future in futures] == [True, False]  # the other may still answer
    bus.nodes[0].destroy()
    bus.spin()
    with pytest.raises(BridgeError, match="nobody answered"):
        _ = futures[1].result


def test_who_takes_the_session_hears_requests(bus: Bus) -> None:
    keys: list[str] = []
    client = bus.create_node("client").create_client(Trigger, "go")
    handler = zenoh.handlers.Callback(lambda query: keys.append(str(query.key_expr)), indirect=False)
    with bus.session.declare_queryable("**", handler, complete=True):
        assert client.service_is_ready
        client.call_async(Trigger.Request())
    assert keys == [client.key]
