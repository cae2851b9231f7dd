"""`twin check`: everything that is wrong or suspicious about a robot file; how truly it drives."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.model.options import RobotFile, reads_robot
from twin.errors import TwinError
from twin.models.options import ReadOptions

if TYPE_CHECKING:
    from rich.console import Group
    from rich.text import Text

    from twin.convert.inspection import Inspection
    from twin.sim.drive_check import DriveReport, Manoeuvre


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


def drive_text(report: DriveReport) -> Group:
    """Return a line per manoeuvre with its error and its bar, then what missed a bar in plain words."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    table = Table(title=_title(report), title_justify="left", box=None)
    table.add_column("")
    table.add_column("manoeuvre", no_wrap=True)
    for name in ("error", "bar"):
        table.add_column(name, justify="right", no_wrap=True)
    for item in report.manoeuvres:
        table.add_row(_mark(item), item.name, _amount(item.error, item.unit), _amount(item.bar, item.unit))
    lines: list[Table | Text] = [table]
    ratio = report.track_ratio / report.analytic_track_ratio - 1.0
    if report.drive.kind == "skid_steer":
        lines.append(
            Text(
                f"effective track: {report.track_ratio:.4f} times {report.drive.wheel_separation:g} m, "
                f"measured by spinning; by theory {report.analytic_track_ratio:.4f} "
                f"({100.0 * ratio:+.2f} %), with equal loads {report.equal_load_track_ratio:.4f}"
            )
        )
    for item in report.manoeuvres:
        if not item.passed:
            lines.append(Text("error[drive]: ", "bold red") + Text(f"{item.name}: {item.words}", "default"))
        elif item.bar is None:
            lines.append(Text("no brake: ", "yellow") + Text(f"{item.name}: {item.words}", "default"))
    return Group(*lines)


def drive_json(report: DriveReport) -> dict[str, Any]:
    """Return the report as JSON data; errors and bars in m, deg and %."""
    drive = report.drive
    return {
        "passed": report.passed,
        "kind": drive.kind,
        "guessed": drive.guessed,
        "left_joints": list(drive.left_joints),
        "right_joints": list(drive.right_joints),
        "wheel_radius": drive.wheel_radius,
        "wheel_separation": drive.wheel_separation,
        "track_ratio": report.track_ratio,
        "analytic_track_ratio": report.analytic_track_ratio,
        "equal_load_track_ratio": report.equal_load_track_ratio,
        "manoeuvres": [
            {
                "name": item.name,
                "passed": item.passed,
                "error": item.error,
                "bar": item.bar,
                "unit": item.unit,
                "words": item.words,
            }
            for item in report.manoeuvres
        ],
    }


def _title(report: DriveReport) -> str:
    drive = report.drive
    wheels = f"{len(drive.left_joints)} + {len(drive.right_joints)} wheels of {1e3 * drive.wheel_radius:g} mm"
    kind = drive.kind.replace("_", " ")
    guessed = "; no drive plugin, guessed by the wheels" if drive.guessed else ""
    return f"{kind}, {wheels}, {1e3 * drive.wheel_separation:g} mm apart{guessed}"


def _mark(item: Manoeuvre) -> Text:
    from rich.text import Text

    if item.bar is None:
        return Text("-", style="yellow")
    return Text("ok", style="green") if item.passed else Text("FAIL", style="bold red")


def _amount(value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    scale, name = (1e3, "mm") if unit == "m" else (1.0, unit)
    return f"{scale * value:.3g} {name}" if scale * value < 1000.0 else f"{scale * value:.0f} {name}"
