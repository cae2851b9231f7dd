"""Ctrl-C at any moment of a command: exit code 130, and nothing on the screen."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

EXIT_CODE = 130
"""As shells count: 128 + SIGINT."""


@contextmanager
def ends_on_interrupt() -> Iterator[None]:
    """Exit with 130 when Ctrl-C ends the block, whatever became of the KeyboardInterrupt on its way."""
    interrupts: list[int] = []

    def on_signal(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)
        raise KeyboardInterrupt

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, on_signal)
    try:
        yield
    except KeyboardInterrupt:
        sys.exit(EXIT_CODE)
    except Exception:
        # Modules in C turn an interrupt while they are imported into an ImportError, or worse.
        if not interrupts:
            raise
        sys.exit(EXIT_CODE)
    finally:
        # CPython: an interrupt inside of an exec, as of a namedtuple, lets the process die of SIGINT in the
        # end although it was handled; the next exec makes it forget (run_eval_code_obj in pythonrun.c).
        exec("")


def sigterm_is_ctrl_c() -> None:
    """Let SIGTERM, with which CI systems end a job that takes too long, end the command as Ctrl-C does."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGTERM, lambda number, frame: signal.raise_signal(signal.SIGINT))
