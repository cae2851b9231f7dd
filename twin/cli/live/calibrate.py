"""`twin calibrate`: what a bag of a physical robot says of a scenario's robot."""

from __future__ import annotations

import json as json_text
import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.console import print_json, stderr, stdout
from twin.cli.option_groups import AsJson, Overrides, Seed, scenario_argument

if TYPE_CHECKING:
    from twin.live.calibration.calibrate import Calibration
    from twin.live.calibration.estimates import Estimate


def calibrate(
    scenario: Annotated[
        Path,
        scenario_argument(metavar="SCENARIO", help="Of the robot's model in its world: a name, or a file."),
    ],
    bag: Annotated[
        Path, typer.Argument(metavar="BAG", help="Folder of a bag, or a .mcap, .db3 or .bag file.")
    ],
    robot: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which of the scenario's robots.", show_default="the only one"),
    ] = None,
    set: Overrides = None,
    seed: Seed = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write the scenario with the patch.", show_default="none"
        ),
    ] = None,
    json: AsJson = False,
) -> None:
    """Estimate wheels, delays and sensors of a physical robot from a bag, and patch the scenario.

    Each number has a 95 % interval, or the reason why the bag does not tell it. The last third of the bag is
    held out, to compare what the scenario predicts before and after the patch.
    """
    from twin.cli.run.options import parse_overrides
    from twin.experiments.shrink import as_file
    from twin.files.writing import check_file
    from twin.live.calibration.calibrate import calibrate as calibrated
    from twin.scenario.schema import load

    if output is not None:
        check_file(output)
    described = load(scenario, parse_overrides(set or (), seed), execute=True)
    with stderr().status(f"{bag}: where were its scans made?"), _silent_faults():
        found = calibrated(described, bag, robot)
    if output is not None:
        as_file.write(found.scenario.source, output, [f"Calibrated by {bag}."])
    if json:
        print_json(_values(found))
    else:
        _report(found, output)


@contextmanager
def _silent_faults() -> Iterator[None]:
    """Let the faults of patches that are tried say nothing."""
    log = logging.getLogger("twin.faults")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


def _values(found: Calibration) -> dict[str, Any]:
    return {
        "robot": found.robot,
        "used_s": found.seconds[0],
        "held_out_s": found.seconds[1],
        "estimates": {
            each.name: {"not_observable": each.not_observable}
            if not each.observable
            else {
                "value": each.value,
                "interval": list(each.interval),
                "believed": each.believed,
                "unit": each.unit,
            }
            for each in found.estimates
        },
        "patch": list(found.patch),
        "held_out": {
            each.name: {"before": each.before, "after": each.after, "unit": each.unit}
            for each in found.divergences
        },
        "notices": list(found.notices),
    }


_SHOWN = {"m": ("mm", 1e3), "s": ("ms", 1e3), "rad": ("deg", math.degrees(1.0)), "1": ("", 1.0)}
"""Units for people, by SI unit, and how many of them one is."""


def _report(found: Calibration, output: Path | None) -> None:
    from rich.table import Table
    from rich.text import Text

    from twin.live.calibration.calibrate import HORIZON_S

    used, held_out = found.seconds
    console = stdout()
    numbers = Table(box=None, pad_edge=False, title_justify="left")
    for title in (found.robot, "estimate", "95 %", "believed", "", ""):
        numbers.add_column(title, justify="left" if title in (found.robot, "") else "right", no_wrap=True)
    for each in found.estimates:
        if each.observable:
            numbers.add_row(each.name, *_row(each), style="bold" if each.differs else "")
    console.print(numbers)
    for each in found.estimates:
        if not each.observable:
            console.print(Text(f"{each.name}: not observable: {each.not_observable}"))
    errors = Table(box=None, pad_edge=False)
    head = f"held out: {held_out:.0f} of {used + held_out:.0f} s, {HORIZON_S:g} s ahead"
    for title in (head, "before", "after", "", ""):
        errors.add_column(title, justify="left" if title in (head, "") else "right", no_wrap=True)
    for row in found.divergences:
        ratio = f"÷ {row.before / row.after:.1f}" if row.after > 0.0 else ""
        unit, scale = _SHOWN["m"] if row.unit == "m" else (row.unit, 1.0)
        errors.add_row(row.name, f"{row.before * scale:.3g}", f"{row.after * scale:.3g}", unit, ratio)
    console.print()
    console.print(errors)
    console.print()
    for notice in found.notices:
        console.print(Text(notice, style="yellow"))
    if not found.patch:
        console.print(Text("nothing to patch: what the model believes is within the intervals"))
        return
    faults = json_text.dumps(list(found.scenario.source.data["faults"]))
    console.print(Text(f"patch: --set 'faults={faults}'"), soft_wrap=True)
    if output is not None:
        console.print(Text(f"written to {output}", style="dim"))


def _row(each: Estimate) -> tuple[str, str, str, str, str]:
    unit, scale = _SHOWN.get(each.unit, (each.unit, 1.0))
    width = each.half_width * scale
    digits = max(0, 1 - math.floor(math.log10(width))) if width > 0.0 else 6
    believed = "" if each.believed is None else f"{each.believed * scale:g}"
    relative = (
        f"{100.0 * (each.factor - 1.0):+.2f} %" if each.believed and each.unit == "m" and each.differs else ""
    )
    return f"{each.value * scale:.{digits}f}", f"± {width:.{digits}f}", believed, unit, relative
