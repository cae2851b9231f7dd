"""How truly a robot drives, as a table and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Group
    from rich.text import Text

    from twin.sim.drive_check import DriveReport, Manoeuvre


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
