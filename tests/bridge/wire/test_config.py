"""Routers, and everything that a Zenoh configuration can say; nothing is open that nobody opened."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bridge.wire.peer import raw_session
from tests.processes import free_endpoint, wait_for
from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import String
from twin.bridge.wire.router import router_session, run_router
from twin.bridge.wire.session import SessionConfig, open_session, session_to_join
from twin.errors import BridgeError

ROOT = Path(__file__).parents[3]


def _config(path: Path, **settings: object) -> Path:
    path.write_text(json.dumps(settings))
    return path


def _sockets() -> set[str]:
    links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]
    return {target for link in links if os.path.lexists(link) and "socket" in (target := os.readlink(link))}


def test_processes_meet_at_a_router(endpoint: str) -> None:
    with (
        run_router(router_session([endpoint])),
        live.join([endpoint]) as talking,
        live.join([endpoint]) as listening,
    ):
        got: list[str] = []
        talker = talking.bus.create_node("talker").create_publisher(String, "chatter")
        listening.bus.create_node("l").create_subscription(String, "chatter", lambda m: got.append(m.data))
        assert talking.spin(until=lambda: talker.has_subscribers, timeout_s=100)
        talker.publish(String("hi"))
        assert listening.spin(until=lambda: got == ["hi"], timeout_s=100)
        assert [n.name for n in Graph.snapshot(listening.bus).nodes] == ["l", "talker"]


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_the_router_command_says_where_it_listens_and_ends_cleanly(endpoint: str, stop: int) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "twin.cli", "router", "--listen", endpoint],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("Started Zenoh router with id ")
        assert line.endswith(f", listening on {endpoint}\n")
        with raw_session(endpoint) as peer:
            assert str(peer.info.routers_zid()[0]) in line
        process.send_signal(stop)
        rest = process.communicate(timeout=120)
    assert (process.returncode, *rest) == (0, "", "")


def test_a_router_listens_on_this_computer_only_unless_told_otherwise(tmp_path: Path, endpoint: str) -> None:
    assert router_session().listen == ("tcp/127.0.0.1:7447",)
    quiet = _config(tmp_path / "quiet.json5", queries_default_timeout=60000)
    assert router_session(file=quiet).listen == ("tcp/127.0.0.1:7447",)
    told = _config(tmp_path / "told.json5", listen={"endpoints": [endpoint]})
    assert router_session(file=told).listen == (endpoint,)


def test_a_configuration_opens_nothing_that_it_does_not_mention(tmp_path: Path) -> None:
    if not Path("/proc/self/fd").exists():
        pytest.skip("needs /proc")
    file = _config(tmp_path / "zenoh.json5", queries_default_timeout=60000)
    before = _sockets()
    with open_session(SessionConfig(file=file)):
        assert _sockets() == before


def test_overrides_as_of_rmw_zenoh(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    other = free_endpoint()
    monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", f'listen/endpoints=["{other}"];scouting/multicast/ttl=1;')
    with Bus.open(Clock(), listen=[endpoint]) as bus, raw_session(other) as peer:
        assert str(peer.info.peers_zid() + peer.info.routers_zid()) or bus
        bus.create_node("here")
        wait_for(lambda: list(peer.liveliness().get("@ros2_lv/**")))
    monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", "no_such_key=1")
    with pytest.raises(BridgeError, match=r"ZENOH_CONFIG_OVERRIDE: 'no_such_key=1' is not valid"):
        Bus.open(Clock(), listen=[endpoint])
    with Bus.open(Clock()):
        pass  # a bus of one process has nothing to override


def test_access_control_denies_a_key(tmp_path: Path, endpoint: str) -> None:
    rule = {
        "id": "no commands",
        "permission": "deny",
        "flows": ["ingress"],
        "messages": ["put"],
        "key_exprs": ["*/cmd_vel/**", "*/secret/**"],
    }
    control = {
        "enabled": True,
        "default_permission": "allow",
        "rules": [rule],
        "subjects": [{"id": "everybody"}],
        "policies": [{"rules": ["no commands"], "subjects": ["everybody"]}],
    }
    file = _config(tmp_path / "acl.json5", listen={"endpoints": [endpoint]}, access_control=control)
    got: list[str] = []
    with (
        Bus.of(SessionConfig(file=file), Clock()) as run,
        live.join([endpoint]) as process,
    ):
        node = run.create_node("a")
        for topic in ("secret", "open"):
            node.create_subscription(String, topic, lambda m, t=topic: got.append(f"{t} {m.data}"))
        talker = process.bus.create_node("b")
        secret, free = (talker.create_publisher(String, topic) for topic in ("secret", "open"))
        wait_for(lambda: free.has_subscribers)
        secret.publish(String("1"))
        free.publish(String("2"))

        def arrived() -> bool:
            run.admit()
            run.spin()
            return bool(got)

        wait_for(arrived)
    assert got == ["open 2"]


def _certificates(folder: Path) -> None:
    """An authority, and a certificate of 127.0.0.1."""
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("needs the openssl command")
    (folder / "san").write_text("subjectAltName=IP:127.0.0.1,DNS:localhost")
    for arguments in (
        "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=authority -keyout ca.key -out ca.pem",
        "req -newkey rsa:2048 -nodes -subj /CN=localhost -keyout server.key -out server.csr",
        "x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -extfile san -out server.pem",
    ):
        subprocess.run([openssl, *arguments.split()], cwd=folder, check=True, capture_output=True)


def test_tls(tmp_path: Path) -> None:
    _certificates(tmp_path)
    endpoint = free_endpoint("tls")
    server = {
        "listen_private_key": str(tmp_path / "server.key"),
        "listen_certificate": str(tmp_path / "server.pem"),
    }
    listener = _config(
        tmp_path / "l.json5", listen={"endpoints": [endpoint]}, transport={"link": {"tls": server}}
    )
    trusting = _config(
        tmp_path / "t.json5", transport={"link": {"tls": {"root_ca_certificate": str(tmp_path / "ca.pem")}}}
    )
    strange = _config(tmp_path / "s.json5", transport={"link": {"tls": {}}})
    with Bus.of(SessionConfig(file=listener), Clock()) as run:
        run.create_node("behind_tls")
        with live.join([endpoint], config=trusting) as process:
            assert [node.name for node in Graph.snapshot(process.bus).nodes] == ["behind_tls"]
        with pytest.raises(BridgeError, match=endpoint), live.join([endpoint], config=strange, timeout_s=0.5):
            pass


def test_a_file_that_is_no_configuration(tmp_path: Path) -> None:
    file = tmp_path / "x.json5"
    file.write_text("{listen: ")
    for act in (lambda: router_session(file=file), lambda: open_session(SessionConfig(file=file))):
        with pytest.raises(BridgeError, match=r"x\.json5: not a Zenoh configuration"):
            act()


def test_where_a_process_joins_if_nobody_says_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """In lock-step as beside a run: `twin exec` asks here in both cases."""
    for name in ("TWIN_CONNECT", "ZENOH_SESSION_CONFIG_URI", "ROS_DOMAIN_ID"):
        monkeypatch.delenv(name, raising=False)
    assert session_to_join().connect == ("tcp/127.0.0.1:7447",)
    monkeypatch.setenv("TWIN_CONNECT", "tcp/127.0.0.1:1")
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert (session_to_join().connect, session_to_join().domain_id) == (("tcp/127.0.0.1:1",), 7)
    assert session_to_join(["tcp/127.0.0.1:2"], domain_id=0).connect == ("tcp/127.0.0.1:2",)
    listening = session_to_join(listen=["tcp/127.0.0.1:3"])
    assert (listening.mode, listening.connect) == ("peer", ())
