"""`twin tree` and `twin graph`: links and joints, as check_urdf prints them, and as a drawing."""

from __future__ import annotations

import sys

import typer

from twin.cli.drawing_file import Output, check_ending, write_drawing
from twin.cli.model.options import RobotFile, reads_robot
from twin.models.options import ReadOptions

REFUSED = 255
"""check_urdf's exit code for a file that it refuses."""


@reads_robot
def tree(file: RobotFile, *, read: ReadOptions) -> None:
    """Print the tree of links in check_urdf's format.

    Exit code 0, or 255 for a file with errors, as check_urdf's.
    """
    from twin.cli.console import print_error
    from twin.errors import ModelError
    from twin.models import load
    from twin.models.graph import tree_text

    try:
        description = load(file, read)
    except ModelError as fault:
        print_error(fault)
        raise typer.Exit(REFUSED) from None
    sys.stdout.write(tree_text(description))


@reads_robot
def graph(file: RobotFile, output: Output = None, *, read: ReadOptions) -> None:
    """Draw links and joints: Graphviz text as urdf_to_graphviz writes it, or SVG, which needs no Graphviz."""
    check_ending(output)
    from twin.models import load
    from twin.models.graph import graphviz, svg

    description = load(file, read)
    write_drawing(output, {".gv": lambda: graphviz(description), ".svg": lambda: svg(description)})
