"""The course's programs as processes, on a port of their own."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.processes import wait_for_listener
from twin.cli.app import run_app

ROOT = Path(__file__).parents[2]


class Program:
    """A running example and what it has printed so far."""

    def __init__(self, *command: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *command],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._lines: list[str] = []
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    @property
    def text(self) -> str:
        """What it printed, without the time."""
        with self._changed:
            return re.sub(r"\[\d+\.\d+\] ", "", "".join(self._lines))

    def wait_for(self, text: str, timeout_s: float = 100.0) -> None:
        """Wait until it has printed a text."""
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while text not in re.sub(r"\[\d+\.\d+\] ", "", "".join(self._lines)):
                left = deadline - time.monotonic()
                assert left > 0.0, f"{text!r} was not printed, but {''.join(self._lines)!r}"
                self._changed.wait(min(left, 0.1))

    def finish(self, timeout_s: float = 100.0) -> int:
        """Wait for its end."""
        code = self.process.wait(timeout_s)
        self._reader.join()
        return code

    def interrupt(self) -> int:
        """End it as Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.finish()

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stdout:
            for line in stdout:
                with self._changed:
                    self._lines.append(line)
                    self._changed.notify_all()


Start = Callable[..., Program]


@pytest.fixture
def start(endpoint: str) -> Iterator[Start]:
    """Start an example; the first one listens, the others connect to it. They end with the test."""
    programs: list[Program] = []

    def begin(name: str, *arguments: str) -> Program:
        if programs:
            wait_for_listener(endpoint)
        how = "--connect" if programs else "--listen"
        programs.append(Program(f"examples/{name}.py", how, endpoint, *arguments))
        return programs[-1]

    yield begin
    for program in reversed(programs):
        program.interrupt()
        assert program.process.returncode == 0, program.text


@pytest.fixture
def command(
    endpoint: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Run `twin …` beside the examples; return exit code, what it printed, and its errors."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["twin", *arguments, "--connect", endpoint])
        with pytest.raises(SystemExit) as ended:
            run_app()
        captured = capsys.readouterr()
        assert isinstance(ended.value.code, int)
        return ended.value.code, captured.out, captured.err

    return run
