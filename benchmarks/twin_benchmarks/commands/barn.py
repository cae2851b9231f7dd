"""`twin bench barn`: a robot drives through worlds of cylinders without a map."""

from __future__ import annotations

import json as json_module
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Group

    from twin_benchmarks.barn.referee import Trial
    from twin_benchmarks.barn.report import BarnReport


def barn(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Worlds in the format twin-barn/1.", show_default=False)
    ],
    worlds: Annotated[
        str | None, typer.Option(metavar="IDS", help="Only these: 3,9,60-90.", show_default="all")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of all noise.")] = 1,
    runs: Annotated[int, typer.Option(min=1, help="Runs of each world, with seeds that count up.")] = 1,
    max_speed: Annotated[float, typer.Option(min=0.1, max=2.0, help="Of the robot in m/s.")] = 2.0,
    no_noise: Annotated[bool, typer.Option("--no-noise", help="A lidar without noise.")] = False,
    latency: Annotated[
        float, typer.Option(min=0.0, help="From a command to the motors in s; a multiple of 0.02.")
    ] = 0.06,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes at a time.", show_default="one per core")
    ] = None,
    sets: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change the scenarios; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the results.", show_default="runs/barn/<time>"),
    ] = None,
    record: Annotated[bool, typer.Option("--record", help="Write Rerun recordings too.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")] = False,
) -> None:
    """Score navigation by the BARN challenge: ten metres through cylinders, without a map, up to 2 m/s.

    Writes a report, a picture of all trajectories, and each world as a scenario for `twin run`.

    Exit code 0: mean score at least 0.45 and nothing touched; 1: not; 2: the file or an option is wrong.
    """
    from twin_benchmarks.barn import worlds as barn_worlds

    rules = barn_worlds.load(file).select(None if worlds is None else world_ids(worlds))
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # of the processes to come: each has a core of its own
    from twin.cli.console import stdout
    from twin.cli.run.folders import results_folder
    from twin.cli.run.options import parse_overrides
    from twin.files.writing import write_whole
    from twin_benchmarks.barn.picture import svg
    from twin_benchmarks.barn.report import BarnReport
    from twin_benchmarks.barn.scenarios import BarnOptions
    from twin_benchmarks.barn.trials import run_worlds

    options = BarnOptions(
        seed=seed,
        runs=runs,
        max_speed=max_speed,
        noise=not no_noise,
        command_latency=latency,
        overrides=tuple(parse_overrides(sets or [], None).items()),
    )
    workers = jobs or os.cpu_count() or 1
    trials: list[Trial] = []
    with results_folder(out, "barn") as folder, _progress(len(rules.worlds) * runs) as show:
        for trial in run_worlds(rules, options, folder, workers=workers, record=record):
            trials.append(trial)
            show(trials)
        report = BarnReport(sorted(trials, key=lambda trial: (trial.world, trial.seed)), options)
        text = json_module.dumps(report.to_dict(), indent=2) + "\n"
        write_whole(folder / "trajectories.svg", svg(rules, report.trials))
        write_whole(folder / "report.json", text)
    if json:
        sys.stdout.write(text)
    else:
        stdout().print(_table(report, folder))
    raise typer.Exit(0 if report.passed else 1)


def world_ids(text: str) -> list[int]:
    """Return the ids of a list such as `3,9,60-90`; of a range, those it would be long to write.

    Raises:
        typer.BadParameter: It is no such list.
    """
    ids: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdigit() or (dash and not last.isdigit()) or len(part) > 20:
            raise typer.BadParameter(
                f"'{part}' is neither a world nor a range; write 3,9,60-90", param_hint="--worlds"
            )
        ids += range(int(first), int(last or first) + 1)
    return ids


@contextmanager
def _progress(total: int) -> Iterator[Callable[[list[Trial]], None]]:
    """Yield a callback that moves the bar; it shows nothing where stderr is no terminal."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from twin.cli.console import stderr

    console = stderr()
    columns = (
        TextColumn("[bold]barn"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TextColumn("{task.fields[text]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("barn", total=total, text="")

        def show(trials: list[Trial]) -> None:
            mean = sum(trial.score for trial in trials) / len(trials)
            hits = sum(trial.outcome == "collision" for trial in trials)
            bar.update(task, completed=len(trials), text=f"score {mean:.3f}, {hits} collisions")

        yield show


def _table(report: BarnReport, folder: Path) -> Group:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    styles = {"success": "green", "collision": "bold red", "timeout": "yellow"}
    table = Table(box=None)
    for name in ("world", "seed", "score", "time", "driven", "clearance"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("")
    for trial in report.trials:
        what = trial.outcome if trial.outcome == "success" else f"{trial.outcome}: {trial.reason}"
        table.add_row(
            str(trial.world),
            str(trial.seed),
            f"{trial.score:.3f}",
            f"{trial.time_s:.1f} s",
            f"{trial.length:.1f} m",
            f"{100.0 * trial.min_clearance:.0f} cm",
            Text(what, style=styles[trial.outcome]),
        )
    mean_time = "" if report.mean_time is None else f", {report.mean_time:.1f} s on average"
    nearest = (
        "" if report.min_clearance is None else f", nearest cylinder {100.0 * report.min_clearance:.1f} cm"
    )
    verdict = Text("PASS ", style="bold green") if report.passed else Text("FAIL ", style="bold red")
    verdict.append(f"score {report.score:.4f}", style="bold")
    verdict.append(
        f" of 0.5: {report.count('success')} of {len(report.trials)} successes{mean_time}, "
        f"{report.count('collision')} collisions, {report.count('timeout')} time-outs{nearest}",
        style="not bold default",
    )
    return Group(table, verdict, Text(f"written to {folder}", style="dim"))
