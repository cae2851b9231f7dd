"""`twin check`: everything that is wrong or suspicious about a robot file."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.model.options import RobotFile, reads_robot
from twin.errors import TwinError
from twin.models.options import ReadOptions

if TYPE_CHECKING:
    from twin.convert.inspection import Inspection
    from twin.sim.drive_check import DriveReport


@reads_robot
def check(
    file: RobotFile,
    every: Annotated[
        bool, typer.Option("--all", help="Print every warning in full, however many are alike.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, for tools.")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit 1 if there are warnings.")] = False,
    drive: Annotated[
        bool, typer.Option("--drive", help="Drive it too: straight, turning, in circles, on a slope.")
    ] = False,
    *,
    read: ReadOptions,
) -> None:
    """Name every fault of a robot file, with its line, the number found, and how to mend it.

    Exit code 0: no errors; 1: warnings, with --strict, or a bar missed, with --drive; 2: errors, the file
    cannot be used.
    """
    from twin.cli.console import stdout
    from twin.cli.model.diagnostics import inspection_json, inspection_text
    from twin.cli.model.drive_table import drive_json, drive_text
    from twin.convert.inspection import inspect_file

    found = inspect_file(file, read)
    try:
        driven, fault = (_driven(found) if drive else None), None
    except TwinError as error:
        driven, fault = None, error
    if json:
        sys.stdout.write(inspection_json(found, {} if driven is None else {"drive": drive_json(driven)}))
    else:
        stdout().print(inspection_text(found, every=every))
        if driven is not None:
            stdout().print(drive_text(driven))
    if fault is not None:
        raise fault
    if found.count("error"):
        raise typer.Exit(2)
    missed = driven is not None and not driven.passed
    raise typer.Exit(1 if missed or (strict and found.count("warning")) else 0)


def _driven(found: Inspection) -> DriveReport | None:
    """Return how the robot drives; None if it cannot be used."""
    from twin.cli.console import stderr
    from twin.sim.drive_check import check_drive

    if found.description is None or found.count("error"):
        return None
    console = stderr()
    with console.status("driving …") if console.is_terminal else nullcontext():
        return check_drive(found.description)
