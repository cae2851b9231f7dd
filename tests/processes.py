"""How tests meet other processes: on a port of their own, and without fixed sleeps."""

from __future__ import annotations

import contextlib
import itertools
import os
import socket
import time
from collections.abc import Callable

POLL_S = 0.005


_PORTS = itertools.cycle(range(10240 + os.getpid() % 70 * 320, 10240 + (os.getpid() % 70 + 1) * 320))
"""Below those that the system gives away: between a look and its use nobody else takes one of them."""


def free_endpoint(protocol: str = "tcp") -> str:
    """An endpoint on which nobody listens."""
    for port in itertools.islice(_PORTS, 320):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return f"{protocol}/127.0.0.1:{port}"
    raise OSError("no port is free")


def wait_for(condition: Callable[[], object], seconds: float = 100.0) -> None:
    """Poll for what another process or thread does."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "nothing happened in time"
        time.sleep(POLL_S)


def wait_for_listener(endpoint: str, seconds: float = 100.0) -> None:
    """Wait until somebody listens there."""
    host, _, port = endpoint.removeprefix("tcp/").partition(":")

    def listens() -> bool:
        with socket.socket() as probe:
            return probe.connect_ex((host, int(port))) == 0

    wait_for(listens, seconds)
