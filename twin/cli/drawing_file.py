"""Where commands that draw a graph write it: Graphviz text or a picture, by the ending of the file."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Mapping
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


def check_ending(output: Path | None, endings: Collection[str] = (".gv", ".svg")) -> None:
    """Refuse, before any work, a file of another ending, or one that cannot be written."""
    if output is not None and output.suffix not in endings:
        *most, last = endings
        raise RecordingError(f"--output {output}: must end in {', '.join(most)} or {last}")
    if output is not None:
        check_file(output)


def write_drawing(output: Path | None, drawings: Mapping[str, Callable[[], str]]) -> None:
    """Write the drawing of the file's ending whole or not at all, or Graphviz text on stdout.

    Raises:
        RecordingError: the file cannot be written.
    """
    text = drawings[".gv" if output is None else output.suffix]()
    if output is None:
        sys.stdout.write(text)
    else:
        write_whole(output, text)
