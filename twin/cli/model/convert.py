"""`twin convert`: a robot file as a MuJoCo model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from twin.cli.model.options import RobotFile, reads_robot
from twin.models.options import ReadOptions


@reads_robot
def convert(
    file: RobotFile,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder to write.", show_default=False)
    ],
    base: Annotated[
        Literal["auto", "free", "fixed"],
        typer.Option(help="fixed: bolted down. auto: free, unless the base weighs nothing."),
    ] = "auto",
    *,
    read: ReadOptions,
) -> None:
    """Write robot.xml and assets/, which plain MuJoCo loads, and report.json: what became of every tag.

    Exit code 0, or 2 for a file that cannot be converted; then nothing is written.
    """
    from twin.cli.console import stdout
    from twin.cli.model.diagnostics import counted
    from twin.convert.export import export
    from twin.models import load
    from twin.sim.drive_check import drive_self_check
    from twin.sim.physics import Physics

    description = load(file, read)
    options = Physics(sleep=False).apply
    report = export(
        description,
        output,
        base=None if base == "auto" else base,
        set_options=options,
        drive_check=drive_self_check,
    )
    tags = ", ".join(f"{number} {outcome}" for outcome, number in report["tags"].items() if number)
    size = ", ".join(counted(len(report[noun + "s"]), noun) for noun in ("link", "joint"))
    guesses, warnings = (len(report[key]) for key in ("guesses", "diagnostics"))
    stdout().print(
        f"{output / 'robot.xml'}: {size}, {report['mass']:.6g} kg; tags: {tags}; "
        f"{guesses} guess{'' if guesses == 1 else 'es'}",
        markup=False,
    )
    driven = report["self_check"].get("drive")
    if driven is not None and not driven["passed"]:
        missed = ", ".join(driven["words"])
        stdout().print(
            f"does not drive as its plugin says: {missed}; see `twin check --drive {file}`", markup=False
        )
    if warnings:
        stdout().print(
            f"{counted(warnings, 'warning')}: see `twin check {file}` or report.json",
            style="dim",
            markup=False,
        )
