"""The progress bar of a run: simulated time, real-time factor, state of the mission; on a terminal only."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from twin.cli.console import stderr
from twin.cli.interrupted import raise_swallowed

if TYPE_CHECKING:
    from twin.runtime import Progress


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
