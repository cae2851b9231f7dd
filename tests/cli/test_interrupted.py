"""Ctrl-C at a moment that makes something else of it."""

from __future__ import annotations

import subprocess
import sys

_SCRIPT = """
import signal
from twin import cli
from twin.cli import app


class Descriptor:
    def __set_name__(self, owner, name):
        signal.raise_signal(signal.SIGINT)


def interrupted():
    class Owner:
        field = Descriptor()


app.app = interrupted
cli.main()
"""


def test_an_interrupt_that_python_wraps_is_one_all_the_same() -> None:
    """Until Python 3.12 what __set_name__ raises becomes the cause of a RuntimeError."""
    done = subprocess.run([sys.executable, "-c", _SCRIPT], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
