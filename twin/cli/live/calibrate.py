"""`twin calibrate`: what a physical robot, or a bag of it, says of a scenario's robot."""

from __future__ import annotations

import json as json_text
import logging
import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.bridge.wire import DEFAULT_ENDPOINT
from twin.cli.console import print_json, stderr, stdout
from twin.cli.option_groups import AsJson, Overrides, Seed, scenario_argument

if TYPE_CHECKING:
    from twin.live.calibration.calibrate import Calibration
    from twin.live.calibration.estimates import Estimate
    from twin.scenario.schema import Scenario

_HEARD = "what was heard"


def calibrate(
    scenario: Annotated[
        Path,
        scenario_argument(metavar="SCENARIO", help="Of the robot's model in its world: a name, or a file."),
    ],
    bag: Annotated[
        Path | None,
        typer.Argument(
            metavar="BAG", help="Folder of a bag, or a .mcap, .db3 or .bag file.", show_default=False
        ),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Listen to a robot that is on the graph, instead of a bag.")
    ] = False,
    duration: Annotated[
        float, typer.Option("--for", metavar="SECONDS", help="How long to listen; Ctrl-C ends it before.")
    ] = 60.0,
    connect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Where the physical robot is, or a router.",
            show_default=f"{DEFAULT_ENDPOINT}, this computer",
        ),
    ] = None,
    domain: Annotated[int, typer.Option(envvar="ROS_DOMAIN_ID", min=0, max=232, help="ROS domain.")] = 0,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Keep what is heard, as a bag.", show_default="none"),
    ] = None,
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
    """Estimate wheels, delays and sensors of a physical robot, from a bag or live, and patch the scenario.

    Each number has a 95 % interval, or the reason why the bag does not tell it. The last third of the bag is
    held out, to compare what the scenario predicts before and after the patch. A robot that is listened to
    is driven by whoever commands it; nothing is said to it.
    """
    if live == (bag is not None):
        raise typer.BadParameter("a bag, or --live instead of it", param_hint="BAG")
    if record is not None and not live:
        raise typer.BadParameter(
            "only --live records; what it is given already is a bag", param_hint="--record"
        )
    from twin.cli.run.options import parse_overrides
    from twin.experiments.shrink import as_file
    from twin.files.writing import check_file
    from twin.live.calibration.calibrate import LEAST_S
    from twin.live.calibration.calibrate import calibrate as calibrated
    from twin.scenario.schema import load

    if not duration >= (least := LEAST_S + 1.0):
        raise typer.BadParameter(f"{duration:g}: must be at least {least:g} s", param_hint="--for")
    if output is not None:
        check_file(output)
    described = load(scenario, parse_overrides(set or (), seed), execute=True)
    with ExitStack() as ending:
        called = str(record or bag or _HEARD)
        if bag is None:
            folder = record or Path(ending.enter_context(TemporaryDirectory())) / "bag"
            _listen(described, robot, connect, domain, folder, duration)
            bag = folder
        ending.enter_context(stderr().status(f"{called}: where were its scans made?"))
        ending.enter_context(_silent_faults())
        found = calibrated(described, bag, robot, called)
    if output is not None:
        as_file.write(found.scenario.source, output, [f"Calibrated by {called}."])
    if json:
        print_json(_values(found))
    else:
        _report(found, output)


def _listen(
    scenario: Scenario,
    robot: str | None,
    connect: list[str] | None,
    domain: int,
    folder: Path,
    seconds: float,
) -> None:
    """Write a bag of a robot that is on the graph."""
    from twin.bridge import live
    from twin.bridge.bags.recorder import Recorder, RecorderConfig
    from twin.bridge.bags.topic_choice import TopicChoice
    from twin.bridge.wire.interrupts import noted_signals
    from twin.live.calibration.calibrate import needed_topics
    from twin.live.calibration.listening import Listening

    names = needed_topics(scenario, robot)
    config = RecorderConfig(topics=TopicChoice(topics=tuple(names.values())))
    with live.join(connect, domain_id=domain) as process, noted_signals() as received, _shown() as show:
        recorder = Recorder(process.bus, folder, config)
        with Listening(process.bus, names, recorder, seconds) as listening:
            while not (received or listening.is_over):
                process.spin_once()
                listening.update()
                show(listening.heard_s, listening.lacks)


@contextmanager
def _shown() -> Iterator[Callable[[float, str], None]]:
    """Yield what shows for how long something was heard [s] and what it lacks.

    It is a line that stays, or, where no terminal is, a line whenever what is lacking is something else.
    """
    console, told = stderr(), None
    with console.status("") as status:

        def show(heard_s: float, lacks: str) -> None:
            nonlocal told
            text = f"{heard_s:.0f} s heard: {lacks or 'enough; more makes it surer'}"
            if console.is_terminal:
                status.update(text)
            elif lacks != told:
                told = lacks
                typer.echo(text, err=True)

        yield show


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
