"""Where commands that draw a graph write it: Graphviz text or SVG, by the ending of the file."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from twin.errors import RecordingError

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", help="File to write: .gv or .svg.", show_default=".gv on stdout"),
]


def check_ending(output: Path | None) -> None:
    """Refuse, before any work, a file that is neither .gv nor .svg; raises RecordingError."""
    if output is not None and output.suffix not in (".gv", ".svg"):
        raise RecordingError(f"--output {output}: must end in .gv or .svg")


def write_drawing(output: Path | None, graphviz: Callable[[], str], svg: Callable[[], str]) -> None:
    """Write the drawing whole or not at all, or Graphviz text on stdout.

    Raises:
        RecordingError: the file cannot be written.
    """
    from twin.scenario.verdict import write_atomically

    if output is None:
        sys.stdout.write(graphviz())
        return
    text = svg() if output.suffix == ".svg" else graphviz()
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(output, text.encode())
    except OSError as fault:
        raise RecordingError(f"--output {output}: cannot be written: {fault.strerror}") from fault
