"""Where commands print: results on stdout, everything else on stderr."""

from __future__ import annotations

import io
import sys
from typing import TYPE_CHECKING, Any

from twin.errors import Problem, TwinError
from twin.plain_text import escaped

WIDE = 100_000
"""Columns where no terminal says how many: what is read by a program, or copied, is not cut."""

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


def guard_terminal() -> None:
    """Let nothing that is printed steer the terminal, nor end the command if it cannot be shown.

    Files and other nodes choose names and texts.
    """
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            _guard(stream)


def _guard(stream: Any) -> None:
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="replace")
    plain_write, keeps_styles = stream.write, stream.isatty()

    def write(text: str) -> int:
        plain_write(escaped(text, keeps_styles=keeps_styles))
        return len(text)

    stream.write = write


def stdout() -> Console:
    """Return the console for results."""
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    if not console.is_terminal:
        console.width = WIDE
    return console


def stderr() -> Console:
    """Return the console for errors and progress."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True)


def print_error(fault: TwinError) -> None:
    """Print each problem on a line of its own, `file:line: message`."""
    from rich.text import Text

    console = stderr()
    for problem in fault.problems:
        console.print(Text("error: ", style="bold red") + _sentence(problem))
    if len(fault.problems) > 1:
        console.print(Text(f"{len(fault.problems)} problems", style="dim"))


def _sentence(problem: Problem) -> Text:
    from rich.text import Text

    text = str(problem)
    place = text[: len(text) - len(problem.message)]
    return Text(escaped(place), style="bold") + Text(escaped(problem.message))
