"""How commands that go on until Ctrl-C end: at once, with exit code 0, without a trace."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any


def endless(
    command: Callable[..., None],
    ends_by_itself: Callable[[Mapping[str, Any]], bool] = lambda given: bool(given.get("once")),
) -> Callable[..., None]:
    """Let Ctrl-C be the ordinary end of a command, unless its options say that it ends by itself."""

    @functools.wraps(command)
    def wrapper(**given: Any) -> None:
        try:
            command(**given)
        except KeyboardInterrupt:
            if ends_by_itself(given):
                raise

    return wrapper


@contextmanager
def quiet_pipe() -> Iterator[None]:
    """Write every line at once, and end quietly when nobody reads any more (`| head -1`)."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(line_buffering=True)
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        # What is still buffered goes nowhere; otherwise the interpreter complains when it flushes at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
