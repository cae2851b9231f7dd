"""Where commands print: results on stdout, everything else on stderr."""

from __future__ import annotations

import codecs
import io
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from twin.errors import Problem, TwinError
from twin.plain_text import escaped

WIDE = 100_000
"""Columns where no terminal says how many: what is read by a program, or copied, is not cut."""

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


class _Guarded:
    """A stream that escapes what steers a terminal, and replaces what its encoding lacks."""

    def __init__(self, stream: Any) -> None:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
        self._stream, self._keeps_styles = stream, stream.isatty()
        self._is_ascii = codecs.lookup(getattr(stream, "encoding", None) or "utf-8").name == "ascii"

    def write(self, text: str) -> int:
        with _named():
            self._stream.write(escaped(text, keeps_styles=self._keeps_styles))
        return len(text)

    def flush(self) -> None:
        with _named():
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        if name == "buffer" and self._is_ascii:
            raise AttributeError(name)  # typer would write UTF-8 there, past this guard
        return getattr(self._stream, name)


@contextmanager
def _named() -> Iterator[None]:
    """Name what could not be written, as faults of files have a name."""
    try:
        yield
    except OSError as fault:
        fault.filename = "what is printed"
        raise


def guard_terminal() -> None:
    """Let nothing that is printed steer the terminal, nor end the command if it cannot be shown.

    Files and other nodes choose names and texts.
    """
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None:
            setattr(sys, name, _Guarded(stream))


def stdout() -> Console:
    """Return the console for results."""
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    if not console.is_terminal:
        console.width = WIDE
    return console


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a listing: names first, which are never cut, and the rest folded where a terminal is narrow."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    for index, name in enumerate(columns):
        table.add_column(name, style="" if index else "bold", no_wrap=not index, overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    stdout().print(table)


def print_json(content: Any) -> None:
    """Print JSON for programs."""
    import json

    sys.stdout.write(json.dumps(content, indent=2, ensure_ascii=False) + "\n")


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
