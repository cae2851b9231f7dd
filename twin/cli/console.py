"""Where commands print: results on stdout, everything else on stderr."""

from __future__ import annotations

from typing import TYPE_CHECKING

from twin.errors import Problem, TwinError

WIDE = 100_000
"""Columns where no terminal says how many: what is read by a program, or copied, is not cut."""

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


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
    return Text(place, style="bold") + Text(problem.message)
