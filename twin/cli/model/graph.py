"""`twin graph`: links and joints as a drawing."""

from __future__ import annotations

from twin.cli.drawing_file import Output, check_ending, write_drawing
from twin.cli.model.options import RobotFile, reads_robot
from twin.models.options import ReadOptions


@reads_robot
def graph(
    file: RobotFile,
    output: Output = None,
    *,
    read: ReadOptions,
) -> None:
    """Draw links and joints: Graphviz text as urdf_to_graphviz writes it, or SVG, which needs no Graphviz."""
    check_ending(output)
    from twin.models import load
    from twin.models.graph import graphviz, svg

    description = load(file, read)
    write_drawing(output, {".gv": lambda: graphviz(description), ".svg": lambda: svg(description)})
