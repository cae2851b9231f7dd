"""Run one scenario in this process, with a progress bar on a terminal.

It shows simulated time, real-time factor and state of the mission.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from twin.api.simulation import Simulation
from twin.cli.console import print_error, stderr, stdout
from twin.cli.interrupted import raise_swallowed, sigterm_is_ctrl_c, was_interrupted
from twin.cli.run.folders import run_folder
from twin.cli.run.options import RunOptions
from twin.errors import TwinError

if TYPE_CHECKING:
    from twin.runtime import Progress


def run_once(options: RunOptions) -> int:
    """Run, write the verdict, print it, and return the exit code."""
    from twin.bridge.programs.console_log import show_warnings

    show_warnings()
    sigterm_is_ctrl_c()
    simulation = Simulation(
        options.scenario,
        overrides=options.overrides,
        params_file=options.params_file,
        out=options.out or run_folder,
        record=not options.no_record,
        bag=options.bag,
        bag_hidden_topics=options.include_hidden_topics,
        save_model=options.save_model,
        pace=options.speed,
        workers=options.workers,
        network=options.network,
        nodes=options.node or (),
        wait_for=options.wait_for or (),
        wait_timeout=options.wait_timeout,
        free=options.free,
        on_execute=lambda file: stderr().print(f"executes {file}"),
    )
    fault = None
    try:
        with run_progress(options.scenario.stem) as progress:
            simulation.run(progress)
    except TwinError as error:
        fault = error
        print_error(error)
    except Exception:  # a bug, ours or of a user's node, or what has become of a Ctrl-C
        if was_interrupted() and simulation.folder is not None:
            replace(simulation.verdict, error="interrupted").write(simulation.folder)
        raise
    verdict = simulation.verdict
    if options.json:
        sys.stdout.write(verdict.to_json())
    elif fault is None:
        from twin.cli.run.verdict_table import verdict_report

        assert simulation.folder is not None
        stdout().print(verdict_report(verdict.to_dict(), simulation.folder))
    return verdict.exit_code


@contextmanager
def run_progress(title: str) -> Iterator[Callable[[Progress], None]]:
    """Yield a callback that moves the bar, if stderr is a terminal, and does not miss a Ctrl-C."""
    console = stderr()
    if not console.is_terminal:
        yield lambda progress: raise_swallowed()
        return
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    bar = Bar(
        TextColumn("[bold]{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.completed:.0f}/{task.total:.0f} s"),
        TextColumn("[cyan]{task.fields[factor]:.1f}x real time"),
        TextColumn("[dim]{task.fields[state]}"),
        console=console,
        transient=True,
        refresh_per_second=5,
    )
    with bar:
        task = bar.add_task(title, total=1.0, factor=0.0, state="loading")

        def show(progress: Progress) -> None:
            raise_swallowed()
            bar.update(
                task,
                completed=progress.time_s,
                total=progress.duration_s,
                factor=progress.real_time_factor,
                state=progress.mission_state,
            )

        yield show
