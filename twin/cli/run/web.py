"""The bridge beside a run: a process of its own that joins the run's graph and ends with it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

_PATIENCE_S = 10.0


def free_endpoint() -> str:
    """Return an endpoint of this computer on which nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@contextmanager
def rosbridge_beside(joining: Sequence[str], serving: Sequence[str], folder: Path) -> Iterator[None]:
    """Run `twin rosbridge` while a block runs; it tells its address on stderr, and lives by `/clock`.

    Args:
        joining: Options by which it finds the run.
        serving: Options of where clients connect, and who may.
        folder: For `rosbridge.jsonl`, the audit of their commands.
    """
    audit = folder / "rosbridge.jsonl"
    words = ["rosbridge", *joining, "--use-sim-time", *serving, "--audit", str(audit)]
    command = [sys.executable, "-m", "twin.cli", *words, "--parent", str(os.getpid())]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sys.stderr) as child:
        try:
            yield
        finally:
            child.send_signal(signal.SIGINT)
            try:
                child.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                child.kill()
