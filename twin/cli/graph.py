"""`twin graph`: links and joints as a drawing."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from twin.cli.model_options import RobotFile, reads_robot
from twin.errors import ModelError
from twin.models.options import ReadOptions


@reads_robot
def graph(
    file: RobotFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="File to write: .gv or .svg.", show_default=".gv on stdout"),
    ] = None,
    *,
    read: ReadOptions,
) -> None:
    """Draw links and joints: Graphviz text as urdf_to_graphviz writes it, or SVG, which needs no Graphviz."""
    if output is not None and output.suffix not in (".gv", ".svg"):
        raise ModelError(f"--output {output}: must end in .gv or .svg")
    from twin.models import load
    from twin.models.graph import graphviz, svg
    from twin.scenario.verdict import write_atomically

    description = load(file, read)
    if output is None:
        sys.stdout.write(graphviz(description))
        return
    text = svg(description) if output.suffix == ".svg" else graphviz(description)
    output.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(output, text.encode())
