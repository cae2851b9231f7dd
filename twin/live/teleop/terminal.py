"""Single keys from a terminal, which is left as it was found."""

from __future__ import annotations

import os
import re
import select
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from twin.errors import TwinError

_KEY = re.compile(r"\x1b[\[O][0-9;]*([A-Za-z~])|\x1b.?|(.)", re.DOTALL)
"""A sequence as of arrows, a key with Alt, a character."""


class Terminal:
    """A terminal that gives keys as they are pressed."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self.is_open = True
        """Whether somebody can still press a key."""

    def pressed(self) -> list[str]:
        """Return the keys that were pressed since, without waiting: characters, and 'arrow A' … 'arrow D'."""
        if not self.is_open or not select.select([self._fd], [], [], 0.0)[0]:
            return []
        try:
            told = os.read(self._fd, 1024)
        except OSError:  # the terminal was closed
            told = b""
        self.is_open = bool(told)
        found = _KEY.finditer(told.decode("utf-8", "replace"))
        return [f"arrow {key[1]}" if key[1] else key[2] or "escape" for key in found]


@contextmanager
def single_keys(fd: int) -> Iterator[Terminal]:
    """Give keys at once, and do not show them, until the end of the block, however it ends.

    Raises:
        TwinError: not a terminal.
    """
    try:
        before = termios.tcgetattr(fd)
    except termios.error:
        raise TwinError(
            "standard input is no terminal: teleoperation takes its keys from one; use ssh -t, docker run -it"
        ) from None
    try:
        tty.setcbreak(fd)
        yield Terminal(fd)
    finally:
        with suppress(termios.error):  # it was closed
            termios.tcsetattr(fd, termios.TCSADRAIN, before)
