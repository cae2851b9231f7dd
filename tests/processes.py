"""How tests meet other processes: on a port of their own, and without fixed sleeps."""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

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


@contextlib.contextmanager
def program(*words: str) -> Iterator[subprocess.Popen[str]]:
    """Run a command of `twin` beside the test until Ctrl-C, which has to end it well."""
    command = [sys.executable, "-m", "twin.cli", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=100)
            assert process.returncode == 0, errors
