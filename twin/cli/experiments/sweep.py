"""`twin sweep`: one scenario with many values and seeds."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from twin.cli.console import print_json, stderr, stdout
from twin.cli.interrupted import sigterm_is_ctrl_c
from twin.cli.option_groups import AsJson, Jobs, scenario_argument

if TYPE_CHECKING:
    from twin.experiments.sweep.making import Backend
    from twin.experiments.sweep.sweep import SweepProgress


def sweep(
    scenario: Annotated[
        Path, scenario_argument(metavar="SCENARIO", help="A scenario of `twin scenarios`, or a file.")
    ],
    set: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUES",
            help="Values of a key: 1,2,3, or 0.1:0.5:0.1 with its end, or 0.1..0.5 to sample.",
        ),
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(
            help="0:1000 for a thousand, or 1..10, or 1,5,9.", show_default="the scenario's one seed"
        ),
    ] = None,
    sample: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Draw N times of the intervals: Latin hypercube.")
    ] = None,
    pass_rate: Annotated[
        float | None, typer.Option(help="Least share of passing runs, judged while they come in.")
    ] = None,
    confidence: Annotated[
        float | None, typer.Option(help="How sure that judgement is to be.", show_default="0.95")
    ] = None,
    jobs: Jobs = 0,
    shard: Annotated[
        str, typer.Option(metavar="I/N", help="Make the I-th of N shares of the runs, from 1/N to N/N.")
    ] = "1/1",
    ray: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run on a Ray cluster: auto, local, or host:port of its head."),
    ] = None,
    time_limit: Annotated[
        float | None,
        typer.Option(min=0.1, metavar="SECONDS", help="End a run that takes longer, by the wall clock."),
    ] = None,
    retry_errors: Annotated[
        bool, typer.Option("--retry-errors", help="Make runs again that ended in an error before.")
    ] = False,
    record: Annotated[
        Literal["none", "few", "failures", "all"],
        typer.Option(help="Which runs get a recording; few: the first failures of some points."),
    ] = "few",
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of the results, also of a sweep to go on with.",
            show_default="runs/<scenario>/sweep-<hash>",
        ),
    ] = None,
    page: Annotated[bool, typer.Option(help="Write report.html, too.")] = True,
    json: AsJson = False,
) -> None:
    """Run a scenario with many values and seeds, and say how sure its pass rate is.

    Every combination of values is run with every seed. The same command goes on with a sweep that was ended,
    and may run on several machines at once, in one folder.

    Exit code 0: pass; 1: fail; 2: a run could not be made; 3: too few runs to say.
    """
    from twin.cli.experiments.sweep_table import share_report, sweep_report
    from twin.experiments.suite.selection import shard_of
    from twin.experiments.sweep.axes import parse_axis, parse_seeds
    from twin.experiments.sweep.plan import make_plan
    from twin.experiments.sweep.summary import summarise
    from twin.experiments.sweep.sweep import sweep as run_sweep
    from twin.scenario.verdict import EXIT_CODES

    sigterm_is_ctrl_c()
    share = shard_of(shard)
    plan = make_plan(
        scenario,
        [parse_axis(word) for word in set or ()],
        seeds=None if seeds is None else parse_seeds(seeds),
        samples=sample,
        pass_rate=pass_rate,
        confidence=confidence,
    )
    folder = out or Path("runs") / plan.name / f"sweep-{plan.identity[:8]}"
    backend = _backend(ray, jobs, folder, time_limit)
    try:
        with _progress(plan.name) as progress:
            result = run_sweep(
                plan,
                folder,
                backend,
                shard=share,
                record=record,
                retry_errors=retry_errors,
                page=page,
                progress=progress,
            )
    except KeyboardInterrupt:
        stderr().print(f"interrupted; the runs so far are kept in {folder}, and the same command goes on")
        raise
    if not result.complete:
        stderr().print(share_report(result))
        return
    summary = summarise(result)
    if json:
        print_json(summary.to_dict())
    else:
        stdout().print(sweep_report(result, summary))
    raise typer.Exit(EXIT_CODES[summary.outcome])


def _backend(ray: str | None, jobs: int, folder: Path, time_limit: float | None) -> Backend:
    if ray is not None:
        from twin.experiments.sweep.ray_cluster import RayCluster

        return RayCluster(ray, jobs or None, time_limit_s=time_limit)
    from twin.experiments.sweep.sweep import local

    return local(jobs or len(os.sched_getaffinity(0)), folder, time_limit)


@contextmanager
def _progress(title: str) -> Iterator[Callable[[SweepProgress], None]]:
    """Yield a callback that moves a bar with an estimate, if stderr is a terminal."""
    console = stderr()
    if not console.is_terminal:
        yield lambda _: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("[bold]{task.description}"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TextColumn("[red]{task.fields[bad]}"),
        TextColumn("left"),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=console,
        transient=True,
        refresh_per_second=5,
        speed_estimate_period=120.0,
    )
    with bar:
        task = bar.add_task(title, total=None, bad="")

        def show(progress: SweepProgress) -> None:
            counts = (("failed", progress.failed), ("errors", progress.errors))
            bad = ", ".join(f"{count} {what}" for what, count in counts if count)
            what = f"{title}, recording failures" if progress.recording else title
            bar.update(task, description=what, completed=progress.done, total=progress.needed, bad=bad)

        yield show
