"""Where commands that draw a graph write it: Graphviz text or SVG, by the ending of the file."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from twin.errors import RecordingError
from twin.files.writing import check_file, write_whole

Output = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", metavar="FILE", help="File to write: .gv or .svg.", show_default=".gv on stdout"
    ),
]


def check_ending(output: Path | None) -> None:
    """Refuse, before any work, a file that is neither .gv nor .svg, or cannot be written."""
    if output is not None and output.suffix not in (".gv", ".svg"):
        raise RecordingError(f"--output {output}: must end in .gv or .svg")
    if output is not None:
        check_file(output)


def write_drawing(output: Path | None, graphviz: Callable[[], str], svg: Callable[[], str]) -> None:
    """Write the drawing whole or not at all, or Graphviz text on stdout.

    Raises:
        RecordingError: the file cannot be written.
    """
    if output is None:
        sys.stdout.write(graphviz())
    else:
        write_whole(output, svg() if output.suffix == ".svg" else graphviz())
