"""Ctrl-C, or a terminal that closes, at any moment of a command: exit code 130, and nothing on the screen."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

EXIT_CODE = 130
"""As shells count: 128 + SIGINT."""
_interrupts: list[int] = []


@contextmanager
def ends_on_interrupt() -> Iterator[None]:
    """Exit with 130 when Ctrl-C ends the block, whatever became of the KeyboardInterrupt on its way."""
    _interrupts.clear()
    sys.unraisablehook = _on_unraisable
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _on_signal)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as nohup wants it
            signal.signal(signal.SIGHUP, _on_signal)
    try:
        yield
    except KeyboardInterrupt:
        sys.exit(EXIT_CODE)
    except Exception:
        # Modules in C turn an interrupt while they are imported into an ImportError, or worse.
        if not _interrupts:
            raise
        sys.exit(EXIT_CODE)
    finally:
        # CPython: an interrupt inside of an exec, as of a namedtuple, lets the process die of SIGINT in the
        # end although it was handled; the next exec makes it forget (run_eval_code_obj in pythonrun.c).
        exec("")


def _is_callback_of_c(frame: FrameType | None) -> bool:
    """Whether LLVM, at work for numba, has called Python: it would print the KeyboardInterrupt and go on."""
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith("llvmlite"):
            return True
        frame = frame.f_back
    return False


def was_interrupted() -> bool:
    """Whether there was a Ctrl-C, whatever it has become since."""
    return bool(_interrupts)


def raise_swallowed() -> None:
    """Raise KeyboardInterrupt if there was a Ctrl-C at a moment that could not raise it."""
    if was_interrupted():
        raise KeyboardInterrupt


def sigterm_is_ctrl_c() -> None:
    """Let SIGTERM, with which CI systems end a job that takes too long, end the command as Ctrl-C does.

    Also where Ctrl-C itself is ignored, as in what a shell's script has put into the background.
    """
    signal.signal(signal.SIGTERM, _on_signal)


def _on_unraisable(told: sys.UnraisableHookArgs) -> None:
    """Say nothing of a Ctrl-C in a destructor, or in a generator that nobody needs any more: it is known."""
    if not issubclass(told.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(told)


def _on_signal(number: int, frame: FrameType | None) -> None:
    _interrupts.append(number)
    if not _is_callback_of_c(frame):
        raise KeyboardInterrupt
