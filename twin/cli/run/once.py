"""Run one scenario in this process, with a progress bar on a terminal.

It shows simulated time, real-time factor and state of the mission.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from twin.api.simulation import Simulation
from twin.cli.console import print_error, print_json, stderr, stdout
from twin.cli.interrupted import raise_swallowed, sigterm_is_ctrl_c, was_interrupted
from twin.cli.run.folders import run_folder
from twin.cli.run.options import RunOptions
from twin.errors import RecordingError, TwinError

if TYPE_CHECKING:
    from twin.experiments.diff import Side
    from twin.runtime import Progress


def run_once(options: RunOptions) -> int:
    """Run, write the verdict, print it, and return the exit code."""
    from twin.bridge.programs.console_log import show_warnings

    show_warnings()
    sigterm_is_ctrl_c()
    golden = None if options.golden is None else _golden(options.golden)
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
        view=options.view,
        workers=options.workers,
        network=options.network,
        nodes=options.node or (),
        wait_for=options.wait_for or (),
        wait_timeout=options.wait_timeout,
        free=options.free or options.web,
        keep_inputs=options.keep_inputs,
        on_execute=lambda file: stderr().print(f"executes {file}"),
    )
    fault = None
    try:
        with _web(options), run_progress(options.scenario.stem) as progress:
            simulation.run(progress)
    except TwinError as error:
        fault = error
        print_error(error)
    except Exception:  # a bug, ours or of a user's node, or what has become of a Ctrl-C
        if was_interrupted() and simulation.folder is not None:
            replace(simulation.verdict, error="interrupted").write(simulation.folder)
        raise
    verdict = simulation.verdict
    difference = None
    if golden is not None and fault is None:
        from twin.experiments.diff import compare, of_path

        assert simulation.folder is not None
        with run_progress("compare") as progress:
            difference = compare(golden, of_path(simulation.folder), progress)
    if options.json and difference is not None:
        both = json.loads(verdict.to_json()) | {"golden": difference.to_dict()}
        print_json(both)
    elif options.json:
        sys.stdout.write(verdict.to_json())
    elif fault is None:
        from twin.cli.run.verdict_table import verdict_report

        assert simulation.folder is not None
        console = stdout()
        short = console.is_terminal
        console.print(verdict_report(verdict.to_dict(), simulation.folder, short=short))
        if difference is not None:
            from twin.cli.experiments.difference_table import difference_report

            console.print(difference_report(difference))
    simulation.wait_for_viewer()
    return max(verdict.exit_code, int(difference is not None and not difference.same))


def _web(options: RunOptions) -> AbstractContextManager[None]:
    """Return the bridge beside the run, if there is to be one."""
    if not options.web:
        return nullcontext()
    from twin.cli.run.web import rosbridge_beside

    return rosbridge_beside(options.joining, options.serving, options.out or Path("runs"))


def _golden(path: Path) -> Side:
    """Return the run that this one is to be; raises RecordingError."""
    from twin.experiments.diff import of_path

    if path.suffix != ".json" and not path.is_dir():
        raise RecordingError(f"--golden {path}: must be the folder of a run, or its hashes.json")
    return of_path(path)


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
