"""A bridge on a bus of its own, run by a thread, for clients with real sockets."""

from __future__ import annotations

import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.live import LiveBus
from twin.web.rosbridge.bridge import BridgeConfig, Limits
from twin.web.rosbridge.process import Rosbridge
from twin.web.rosbridge.server import ServerConfig


@contextmanager
def serving(
    config: ServerConfig,
    limits: Limits | None = None,
    nodes: Callable[[Bus], Any] = lambda bus: None,
    audit: Callable[[str], None] = lambda line: None,
) -> Iterator[Rosbridge]:
    """A bridge on a bus of its own, run by a thread."""
    made: list[Rosbridge] = []
    ready, over = threading.Event(), threading.Event()

    def run() -> None:
        clock = Clock()
        with Bus.open(clock) as bus:
            process = LiveBus(bus, clock, use_sim_time=False)
            rosbridge = Rosbridge(process, config, BridgeConfig(limits or Limits(), audit=audit))
            nodes(bus)
            made.append(rosbridge)
            ready.set()
            try:
                rosbridge.spin(over.is_set)
            finally:
                rosbridge.close()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        assert ready.wait(60.0)
        yield made[0]
    finally:
        over.set()
        thread.join(60.0)


def get(server: Rosbridge, path: str, **headers: str) -> Any:
    """Return the answer of a server to a GET; raises HTTPError for a refusal."""
    address = server.server.address.replace("ws://", "http://")
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return urllib.request.urlopen(urllib.request.Request(address + path, headers=named), timeout=60.0)


def refused(server: Rosbridge, path: str, **headers: str) -> tuple[int, str]:
    """Return the status of an answer and, if it is a refusal, its sentence."""
    try:
        with get(server, path, **headers) as answer:
            return int(answer.status), ""
    except urllib.error.HTTPError as refusal:
        with refusal:
            return refusal.code, refusal.read().decode()
