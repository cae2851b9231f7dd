"""`twin check`: everything that is wrong or suspicious about a robot file."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from twin.cli.model_options import RobotFile, reads_robot
from twin.models.options import ReadOptions


@reads_robot
def check(
    file: RobotFile,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, for tools.")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit 1 if there are warnings.")] = False,
    *,
    read: ReadOptions,
) -> None:
    """Name every fault of a robot file, with its line, the number found, and how to mend it.

    Exit code 0: no errors; 1: warnings, with --strict; 2: errors, the file cannot be used.
    """
    from twin.cli.console import stdout
    from twin.cli.diagnostics import inspection_json, inspection_text
    from twin.convert.inspection import inspect_file

    found = inspect_file(file, read)
    if json:
        sys.stdout.write(inspection_json(found))
    else:
        stdout().print(inspection_text(found))
    if found.count("error"):
        raise typer.Exit(2)
    raise typer.Exit(1 if strict and found.count("warning") else 0)
