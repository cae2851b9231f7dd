"""`twin bench slam`: SLAM on recorded lidar logs."""

from __future__ import annotations

import json as json_module
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from twin.navigation.mapping.slam import Slam
    from twin_benchmarks.slam.trial import SlamTrial


def slam(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="Lidar logs (.npz); FILE.relations beside one is what it is scored by.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write map, picture and pose graph of each log.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")] = False,
) -> None:
    """Map recorded lidar logs and score the paths by relations between their poses (Kümmerle et al. 2009).

    A log without a file of relations is scored by those of its reference poses.

    Exit code 0: all within 0.07 m, 1 degree and 10 times real time; 1: one is not; 2: a file is wrong.
    """
    from twin.cli.console import stdout
    from twin.cli.run.folders import results_folder
    from twin_benchmarks.slam.log import load_log
    from twin_benchmarks.slam.relations import load_relations, relations_of
    from twin_benchmarks.slam.trial import run_log

    paths = list(
        dict.fromkeys(path.with_suffix(".npz") if path.suffix == ".relations" else path for path in files)
    )
    logs = [load_log(path) for path in paths]
    beside = [path.with_suffix(".relations") for path in paths]
    truths = [
        load_relations(path, len(log.ranges)) if path.exists() else relations_of(log.reference)
        for path, log in zip(beside, logs, strict=True)
    ]
    trials: list[SlamTrial] = []
    with (
        nullcontext() if out is None else results_folder(out, "") as folder,
        _progress(sum(len(log.ranges) for log in logs)) as show,
    ):
        for log, truth in zip(logs, truths, strict=True):
            done = sum(trial.scans for trial in trials)
            trial, mapped = run_log(log, truth, partial(show, log.name, done))
            trials.append(trial)
            if folder is not None:
                _write(folder, log.name, mapped)
    if json:
        sys.stdout.write(json_module.dumps([trial.to_dict() for trial in trials], indent=2) + "\n")
    else:
        console = stdout()
        console.width = max(console.width, 100)  # a table that is cut tells nothing
        console.print(_table(trials))
        if folder is not None:
            stdout().print(f"maps in {folder}", style="dim")
    raise typer.Exit(0 if all(trial.passed for trial in trials) else 1)


def _write(folder: Path, name: str, mapped: Slam) -> None:
    from twin.files.writing import write_whole
    from twin_benchmarks.slam.picture import png

    mapped.map().save(folder / f"{name}.yaml")
    write_whole(folder / f"{name}.png", png(mapped))
    mapped.save(folder / f"{name}.posegraph")


def _table(trials: list[SlamTrial]) -> Table:
    from rich.table import Table

    table = Table(
        box=None, title="errors of relations: mean ± deviation", title_justify="left", padding=(0, 1, 0, 0)
    )
    table.add_column("log", no_wrap=True)
    for heading in ("scans", "length", "slam [m]", "slam [°]", "odom [m]", "odom [°]"):
        table.add_column(heading, justify="right", no_wrap=True)
    for heading in ("loops", "time", "speed", ""):
        table.add_column(heading, justify="right", no_wrap=True)
    for trial in trials:
        slam, odometry = trial.slam, trial.odometry
        table.add_row(
            trial.log,
            str(trial.scans),
            f"{trial.length:.0f} m",
            f"{slam.translation_mean:.3f}±{slam.translation_std:.3f}",
            f"{slam.rotation_mean:.2f}±{slam.rotation_std:.2f}",
            f"{odometry.translation_mean:.3f}",
            f"{odometry.rotation_mean:.2f}",
            str(trial.loops),
            f"{trial.seconds:.1f} s",
            f"{'' if trial.timed else '~'}{trial.real_time:.0f}x",
            "[green]pass" if trial.passed else "[red]fail",
        )
    return table


@contextmanager
def _progress(total: int) -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback that moves the bar; it shows nothing where stderr is no terminal."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from twin.cli.console import stderr

    console = stderr()
    columns = (
        TextColumn("[bold]{task.fields[log]}"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("slam", total=total, log="")

        def show(log: str, before: int, scans: int) -> None:
            bar.update(task, completed=before + scans, log=log)

        yield show
