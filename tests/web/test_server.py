"""The server on real sockets: who is let in, and what becomes of those who misbehave."""

from __future__ import annotations

import contextlib
import json
import shutil
import socket
import subprocess
import threading
import time
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.protocol import State
from websockets.server import ServerProtocol
from websockets.sync.client import ClientConnection, connect

from tests.processes import wait_for
from tests.web.serving import get, refused, serving
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.live import LiveBus
from twin.bridge.msgs import String, Twist
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Trigger
from twin.errors import BridgeError
from twin.web.rosbridge.access import read_tokens
from twin.web.rosbridge.bridge import Bridge, BridgeConfig, Limits
from twin.web.rosbridge.delivery import Recipient
from twin.web.rosbridge.frames import Heard
from twin.web.rosbridge.outbox import Outbox
from twin.web.rosbridge.process import Rosbridge
from twin.web.rosbridge.server import Server, ServerConfig

HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)
SECRETS = "viewer-0123456789", "operator-0123456789"


def ask(client: ClientConnection, **message: Any) -> dict[str, Any]:
    client.send(json.dumps(message))
    return json.loads(client.recv(timeout=60.0))


def topics(client: ClientConnection) -> dict[str, Any]:
    return ask(client, op="call_service", service="/rosapi/topics")


@pytest.fixture
def tokens(tmp_path: Path) -> ServerConfig:
    file = tmp_path / "tokens"
    file.write_text(f"# secrets\n{SECRETS[0]} viewer\n{SECRETS[1]} operator Mei  # at the desk\n")
    return ServerConfig(port=0, tokens=read_tokens(file))


@pytest.mark.parametrize("how", ["header", "query", "message"])
def test_a_token_lets_in(tokens: ServerConfig, how: str) -> None:
    with serving(tokens) as server:
        query = f"/?token={SECRETS[0]}" if how == "query" else ""
        headers = {"Authorization": f"Bearer {SECRETS[0]}"} if how == "header" else {}
        with connect(server.server.address + query, additional_headers=headers) as client:
            if how == "message":
                client.send(json.dumps({"op": "auth", "token": SECRETS[0]}))
            assert topics(client)["result"]
            told = ask(client, op="advertise", topic="/cmd_vel", type="geometry_msgs/Twist")
            assert "the role viewer" in told["msg"]


def test_ten_wrong_tokens_lock_an_address_out(tokens: ServerConfig) -> None:
    audited: list[dict[str, Any]] = []
    with serving(tokens, audit=lambda line: audited.append(json.loads(line))) as server:
        address = server.server.address
        with connect(address) as client:
            client.send(json.dumps({"op": "call_service", "service": "/rosapi/topics"}))
            with pytest.raises(ConnectionClosed, match="1008"):
                client.recv(timeout=60.0)
        with connect(f"{address}/?token={SECRETS[1]}") as client:
            assert topics(client)["result"]
        for _ in range(10):
            with pytest.raises(InvalidStatus, match="401"):
                connect(f"{address}/?token=wrong")
        with pytest.raises(InvalidStatus, match="401"):
            connect(f"{address}/?token={SECRETS[1]}")
        with connect(f"{address}/?token={SECRETS[1]}", source_address=("127.0.0.2", 0)) as client:
            assert topics(client)["result"]  # another address
    wrong = {"op": "connect", "name": "127.0.0.1", "values": {"refused": "wrong token"}}
    assert [{key: line[key] for key in wrong} for line in audited] == [wrong] * 10


def test_what_a_stranger_sends_after_a_wrong_token_does_no_harm(tokens: ServerConfig) -> None:
    with serving(tokens) as server:
        address = server.server.address
        with connect(address) as client:
            client.protocol.send_text(json.dumps({"op": "auth", "token": "wrong"}).encode())
            client.protocol.send_text(
                json.dumps({"op": "call_service", "service": "/rosapi/topics"}).encode()
            )
            client.socket.sendall(b"".join(client.protocol.data_to_send()))  # both are there before it closes
            with pytest.raises(ConnectionClosed):
                client.recv(timeout=60.0)
        with connect(f"{address}/?token={SECRETS[1]}") as client:
            assert topics(client)["result"]


@pytest.mark.parametrize("header", ["Host", "Origin", "Authorization"])
def test_a_header_that_is_there_twice_is_refused(header: str) -> None:
    with serving(ServerConfig(port=0)) as server:
        _, _, host = server.server.address.partition("//")
        with socket.create_connection(tuple(host.rsplit(":", 1)), timeout=60.0) as client:  # type: ignore[arg-type]
            lines = {"Host": f"Host: {host}", "Origin": "", "Authorization": ""}
            said = "\r\n".join(["GET / HTTP/1.1", *filter(None, lines.values()), *[f"{header}: {host}"] * 2])
            client.sendall(f"{said}\r\n\r\n".encode())
            assert client.recv(1000).startswith(b"HTTP/1.1 400 ")


def test_more_than_this_computer_needs_a_token() -> None:
    with pytest.raises(BridgeError, match="--token"):
        ServerConfig(address="0.0.0.0")


@pytest.mark.parametrize("line", ["short viewer", f"{SECRETS[0]} king", SECRETS[0], "# nothing"])
def test_a_file_of_no_tokens_is_refused_and_not_told(tmp_path: Path, line: str) -> None:
    file = tmp_path / "tokens"
    file.write_text(line)
    with pytest.raises(BridgeError) as fault:
        read_tokens(file)
    assert SECRETS[0] not in str(fault.value)


@pytest.mark.parametrize(
    ("origin", "is_welcome"),
    [
        ("http://localhost:8000", True),
        ("http://hall.example", True),
        ("http://evil.example", False),
        ("null", False),
        ("http://127.0.0.1.evil.example", False),
    ],
)
def test_pages_of_other_servers_are_kept_out(origin: str, is_welcome: bool) -> None:
    with serving(ServerConfig(port=0, origins=("http://hall.example",))) as server:
        if is_welcome:
            with connect(server.server.address, origin=origin) as client:  # type: ignore[arg-type]
                assert topics(client)["result"]
        else:
            with pytest.raises(InvalidStatus, match="403"):
                connect(server.server.address, origin=origin)  # type: ignore[arg-type]


def test_a_name_of_somebody_else_is_refused() -> None:
    with serving(ServerConfig(port=0)) as server:
        address = server.server.address.replace("ws://", "http://")
        request = urllib.request.Request(address, headers={"Host": "rebound.example"})
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(request, timeout=60.0)


def test_files_for_browsers(tmp_path: Path) -> None:
    (tmp_path / "page").mkdir()
    page = b'<script type="importmap">{"imports":{}}</script>'
    (tmp_path / "page" / "index.html").write_bytes(page)
    (tmp_path / "page" / "app.mjs").write_text("export {}")
    (tmp_path / "page" / ".hidden").write_text("secret")
    (tmp_path / "secret").write_text("secret")
    (tmp_path / "page" / "link").symlink_to(tmp_path / "secret")
    with serving(ServerConfig(port=0, folders={"": tmp_path / "page"})) as server:
        address = server.server.address.replace("ws://", "http://")
        with urllib.request.urlopen(f"{address}/?x=1", timeout=60.0) as answer:
            assert answer.read() == page
            policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'self'" in policy
        assert "'sha256-" in policy
        with urllib.request.urlopen(f"{address}/app.mjs", timeout=60.0) as answer:
            assert answer.headers["Content-Type"].startswith("text/javascript")
        for path in ("/none", "/../secret", "/%2e%2e/secret", "/.hidden", "/link", "//etc/passwd", "/a%00b"):
            with pytest.raises(urllib.error.HTTPError, match="404"):
                urllib.request.urlopen(address + path, timeout=60.0)


def test_meshes_of_packages(tmp_path: Path, tokens: ServerConfig) -> None:
    package = tmp_path / "arm_description"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>arm_description</name></package>")
    (package / "meshes" / "arm 1.stl").write_bytes(b"solid")
    (package / "secret.txt").write_text("no")
    with serving(replace(tokens, packages=package)) as server:
        known = f"?token={SECRETS[0]}"
        assert refused(server, "/meshes/arm_description/meshes/arm%201.stl")[0] == 401
        with get(server, f"/meshes/arm_description/meshes/arm%201.stl{known}") as answer:
            assert (answer.read(), answer.headers["Content-Type"]) == (b"solid", "model/stl")
        for path in (
            "arm_description/secret.txt",
            "arm_description/../secret.stl",
            "nobody/a.stl",
            "a%00b.stl",
            "",
        ):
            assert refused(server, f"/meshes/{path}{known}")[0] == 404
    with serving(ServerConfig(port=0)) as server:
        assert refused(server, "/meshes/arm_description/meshes/arm%201.stl") == (
            404, "this server gives no meshes\n",
        )  # fmt: skip


def test_too_large_too_often_too_many() -> None:
    limits = Limits(message_bytes=10_000, messages_per_s=20.0, clients=2)
    with serving(ServerConfig(port=0), limits) as server:
        address = server.server.address
        with connect(address) as client, connect(address) as other:
            with pytest.raises(InvalidStatus, match="503"):
                connect(address)
            other.send("x" * 20_000)
            with pytest.raises(ConnectionClosed, match="1009"):
                other.recv(timeout=60.0)
            for _ in range(200):
                client.send(json.dumps({"op": "set_level", "level": "info"}))
            assert "more than 20 messages a second" in json.loads(client.recv(timeout=60.0))["msg"]
        wait_for(lambda: not server.server.connections)
        with connect(address) as client:
            client.send("no json")
            assert "no JSON" in json.loads(client.recv(timeout=60.0))["msg"]
            assert topics(client)["result"]


def test_a_thousand_connections_leave_room_for_nobody_else_and_nothing_behind() -> None:
    with serving(ServerConfig(port=0)) as server:
        host, port = server.server.address.removeprefix("ws://").split(":")
        with contextlib.ExitStack() as stack:
            clients = [stack.enter_context(connect(server.server.address)) for _ in range(50)]
            sockets = [socket.create_connection((host, int(port)), timeout=60.0) for _ in range(950)]
            for each in sockets:
                stack.enter_context(each)
            refused = 0
            for each in sockets[:100]:
                each.sendall(HANDSHAKE)
                refused += b" 503 " in each.recv(1000)
            assert refused == 100
            assert all(topics(client)["result"] for client in clients)
        wait_for(lambda: not server.server.connections)
        with connect(server.server.address) as client:
            assert topics(client)["result"]


def test_a_stop_overtakes_what_waits_and_is_never_too_much() -> None:
    order: list[str] = []

    def nodes(bus: Bus) -> None:
        node = bus.create_node("robot")
        node.create_subscription(String, "/chatter", lambda message: order.append(message.data), 1000)
        node.create_service(
            Trigger, "/guard/stop", lambda r: order.append("stop") or Trigger.Response(True, "")
        )
        # A bridge that is busy: all that is sent meanwhile waits.
        node.create_subscription(String, "/busy", lambda message: time.sleep(0.5), 10)

    limits = Limits(messages_per_s=60.0)
    with serving(ServerConfig(port=0), limits, nodes) as server, connect(server.server.address) as client:
        for topic in ("/chatter", "/busy"):
            client.send(json.dumps({"op": "advertise", "topic": topic, "type": "std_msgs/String"}))
        client.send(json.dumps({"op": "publish", "topic": "/busy", "msg": {}}))
        time.sleep(0.2)
        for number in range(150):  # more than the rate: what is too much is dropped, the stop is not
            client.send(json.dumps({"op": "publish", "topic": "/chatter", "msg": {"data": str(number)}}))
        client.send(json.dumps({"op": "call_service", "service": "/guard/stop", "id": "stop"}))
        while json.loads(client.recv(timeout=60.0)).get("id") != "stop":
            pass
        wait_for(lambda: "stop" in order and len(order) > 50)
    before = order.index("stop")
    assert before < 20, f"{before} messages were handled before the stop"


def test_a_stop_is_done_between_two_messages_of_many_that_have_come() -> None:
    order: list[str] = []
    publishers: list[Any] = []

    def audit(line: str) -> None:
        order.extend("stop" for _ in range(json.loads(line)["target"] == "/guard/stop"))

    def nodes(bus: Bus) -> None:
        publishers.append(bus.create_node("crowd").create_publisher(String, "/crowd", 1000))

    with (
        serving(ServerConfig(port=0), nodes=nodes, audit=audit) as rosbridge,
        connect(rosbridge.server.address) as client,
    ):
        client.send(json.dumps({"op": "advertise", "topic": "/guard/stop", "type": "std_msgs/Header"}))
        wait_for(lambda: rosbridge.bridge.topics.type_of("/guard/stop"))

        def take(heard: Heard) -> None:
            order.append(heard.message.data)
            if heard.message.data == "10":
                client.send(json.dumps({"op": "publish", "topic": "/guard/stop", "msg": {}}))
                wait_for(lambda: rosbridge.server.has_urgent)

        def crowd(bridge: Bridge) -> None:
            bridge.topics.watch("test", "/crowd", take)
            for number in range(100):
                publishers[0].publish(String(str(number)))

        rosbridge.server.ask(crowd)
        wait_for(lambda: order[-1:] == ["99"])
    assert order == [*map(str, range(11)), "stop", *map(str, range(11, 100))]


def test_what_goes_to_several_clients_comes_to_each_in_order() -> None:
    publishers: list[Any] = []

    def nodes(bus: Bus) -> None:
        publishers.append(bus.create_node("talker").create_publisher(String, "/chatter", 1000))

    def numbers(client: ClientConnection, most: int) -> list[str]:
        return [json.loads(client.recv(timeout=60.0))["msg"]["data"] for _ in range(most)]

    with serving(ServerConfig(port=0), nodes=nodes) as rosbridge, contextlib.ExitStack() as stack:
        address = rosbridge.server.address
        clients = [stack.enter_context(connect(address)) for _ in range(4)]
        for client in clients:
            client.send(json.dumps({"op": "subscribe", "topic": "/chatter"}))
            topics(client)  # was answered after it
        rosbridge.server.ask(lambda bridge: [publishers[0].publish(String(str(n))) for n in range(30)])
        heard = [numbers(client, 10) for client in clients]
        clients.pop().close()
        heard = [each + numbers(client, 20) for each, client in zip(heard, clients, strict=False)]
        wait_for(lambda: len(rosbridge.server.recipients) == 3)
    assert heard == [[str(number) for number in range(30)]] * 3


def test_what_somebody_said_who_has_gone_since_is_not_done() -> None:
    publishers: list[Any] = []

    def nodes(bus: Bus) -> None:
        publishers.append(bus.create_node("talker").create_publisher(String, "/chatter", 10))

    with serving(ServerConfig(port=0), nodes=nodes) as rosbridge, connect(rosbridge.server.address) as other:
        server = rosbridge.server
        with connect(server.address) as client:
            topics(client)
            server.ask(lambda bridge: wait_for(lambda: server.has_urgent))  # it goes before it is heard
            client.send(json.dumps({"op": "subscribe", "topic": "/chatter"}))
            client.send(json.dumps({"op": "advertise", "topic": "/ghost", "type": "std_msgs/String"}))
        other.send(json.dumps({"op": "subscribe", "topic": "/chatter"}))
        found = topics(other)["values"]["topics"]
        server.ask(lambda bridge: publishers[0].publish(String("x")))
        assert json.loads(other.recv(timeout=60.0))["msg"] == {"data": "x"}
        assert "/ghost" not in found
        assert len(server.recipients) == 1


def test_all_that_waits_for_a_client_goes_out_in_one_write() -> None:
    protocol, written = ServerProtocol(), []
    protocol.state = State.OPEN
    filled = 0
    transport = SimpleNamespace(write=written.append, get_write_buffer_size=lambda: filled)
    outbox = Outbox(10_000_000)
    recipient = Recipient(SimpleNamespace(protocol=protocol, transport=transport), outbox)  # type: ignore[arg-type]
    for frame, topic in ((b"text", "/a"), (b"binary", "/b"), (b"answer", None)):
        outbox.put(frame, topic)
    assert recipient.write()
    assert written == [b"answertextbinary"]
    assert recipient.write()
    assert len(written) == 1, "nothing is left"
    filled = 1_000_000
    assert recipient.write(), "nothing waits, so nobody does, however much is on its way"
    outbox.put(b"later", "/a")
    assert not recipient.write()
    assert len(written) == 1, "a client that does not keep up is waited for"


def test_who_is_gone_while_it_steers_is_stopped() -> None:
    heard: list[float] = []

    def nodes(bus: Bus) -> None:
        robot = bus.create_node("robot")
        robot.create_subscription(Twist, "/cmd_vel", lambda message: heard.append(message.linear.x), 10)

    with serving(ServerConfig(port=0), nodes=nodes) as server, connect(server.server.address) as client:
        client.send(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.3}}}))
        wait_for(lambda: heard == [0.3])
        client.socket.shutdown(socket.SHUT_RDWR)  # a browser that is killed says no goodbye
        wait_for(lambda: heard == [0.3, 0.0])


def subscribed(address: str, topic: str) -> socket.socket:
    """Return a client's socket from which nothing is read."""
    lazy = socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2])))
    lazy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    lazy.sendall(HANDSHAKE)
    text = json.dumps({"op": "subscribe", "topic": topic}).encode()
    lazy.sendall(bytes([0x81, 0x80 | len(text)]) + bytes(4) + text)
    return lazy


def test_who_reads_nothing_is_given_up_and_others_hear() -> None:
    limits = Limits(stalled_s=0.5, waiting_bytes=1_000_000)
    talking = threading.Event()

    def nodes(bus: Bus) -> None:
        node = bus.create_node("talker")
        publisher = node.create_publisher(String, "/big")
        node.create_timer(
            10_000_000, lambda: None if talking.is_set() else publisher.publish(String("x" * 200_000))
        )

    with serving(ServerConfig(port=0), limits, nodes) as server:
        address = server.server.address
        with connect(address, max_size=None) as reader:
            lazy = subscribed(address, "/big")
            wait_for(lambda: len(server.server.connections) == 2)
            reader.send(json.dumps({"op": "subscribe", "topic": "/big"}))
            waiting = []

            def is_gone() -> bool:
                reader.recv(timeout=60.0)
                waiting.extend(c.recipient.outbox._bytes for c in tuple(server.server.connections))
                return len(server.server.connections) == 1

            wait_for(is_gone)
            assert max(waiting) <= 1_300_000
            talking.set()
            lazy.close()


def test_a_large_message_that_somebody_does_not_read_holds_up_nobody() -> None:
    def nodes(bus: Bus) -> None:
        bus.create_node("map").create_publisher(String, "/map", LATCHED).publish(String("x" * 10_000_000))

    with (
        serving(ServerConfig(port=0), nodes=nodes) as rosbridge,
        connect(rosbridge.server.address) as other,
        subscribed(rosbridge.server.address, "/map") as lazy,
    ):
        assert lazy.recv(1)  # of the handshake
        for _ in range(20):
            assert "/map" in topics(other)["values"]["topics"]
            time.sleep(0.02)


@pytest.mark.parametrize("at_once", [1, 100, 1_000_000])
def test_newer_messages_win(at_once: int) -> None:
    outbox = Outbox(1000)

    def taken() -> list[bytes]:
        frames = []
        while found := outbox.take_up_to(at_once):
            frames += found
        return frames

    for _ in range(2):  # what was taken leaves nothing behind
        for number in range(100):
            outbox.put(b"%d" % number, "/a")
        outbox.put(b"other", "/b")
        outbox.put(b"answer", None)
        assert taken() == [b"answer", *(b"%d" % number for number in range(68, 100)), b"other"]
    outbox.put(b"x" * 900, "/a")
    outbox.put(b"y" * 900, "/b")
    assert taken() == [b"y" * 900]
    dropped = outbox.dropped
    for _ in range(10):
        outbox.put(b"x" * 200, "/a")
        outbox.put(b"y" * 200, "/b")
        assert len(taken()) == 2
    assert outbox.dropped == dropped, "what was taken waits no more"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificate")
def test_tls(tmp_path: Path) -> None:
    import ssl

    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
         "-keyout", key, "-out", certificate, "-days", "1", "-subj", "/CN=localhost",
         "-addext", "subjectAltName=IP:127.0.0.1"],
        check=True, capture_output=True,
    )  # fmt: skip
    with serving(ServerConfig(port=0, certificate=certificate, key=key)) as server:
        context = ssl.create_default_context(cafile=certificate)
        assert server.server.address.startswith("wss://")
        with connect(server.server.address, ssl=context) as client:
            assert topics(client)["result"]


def test_a_port_that_is_taken_is_a_sentence() -> None:
    with serving(ServerConfig(port=0)) as server:
        port = int(server.server.address.rpartition(":")[2])
        clock = Clock()
        with Bus.open(clock) as bus, pytest.raises(BridgeError, match="cannot listen"):
            Rosbridge(LiveBus(bus, clock, use_sim_time=False), ServerConfig(port=port), BridgeConfig())


@pytest.mark.parametrize("text", [None, "no certificate"])
def test_files_of_tls_that_are_none_are_a_sentence(tmp_path: Path, text: str | None) -> None:
    file = tmp_path / "certificate.pem"
    if text is not None:
        file.write_text(text)
    with pytest.raises(BridgeError, match=r"certificate\.pem: no certificate in PEM"):
        Server(ServerConfig(port=0, certificate=file), Limits(), lambda: None).start()
