"""How far many runs are, on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from twin.cli.console import stderr

if TYPE_CHECKING:
    from rich.progress import Progress

    from twin.experiments.suite.cases import Case


class BatchProgress:
    """A bar over all runs, with what runs now."""

    def __init__(self, bar: Progress | None, total: int) -> None:
        self._bar = bar
        self._running: dict[str, None] = {}
        self._bad = 0
        if bar is not None:
            self._task = bar.add_task("", total=total, bad="", now="")

    def begin(self, case: Case) -> None:
        """Show that a test runs."""
        self._running[case.name] = None
        self._show(0)

    def end(self, case: Case, verdict: Mapping[str, Any]) -> None:
        """Show that a test is over, and keep the name of one that did not pass on the screen."""
        self._running.pop(case.name, None)
        if verdict["verdict"] != "pass":
            self._bad += 1
            if self._bar is not None:
                self._bar.console.print(f"[bold red]{verdict['verdict'].upper()}[/] ", end="")
                self._bar.console.print(case.name, markup=False)
        self._show(1)

    def _show(self, done: int) -> None:
        if self._bar is not None:
            bad = f"[red]{self._bad} not passed" if self._bad else ""
            now = ", ".join(self._running).replace("[", "\\[")
            self._bar.update(self._task, advance=done, bad=bad, now=now)


@contextmanager
def batch_progress(total: int) -> Iterator[BatchProgress]:
    """Yield what shows a bar, if stderr is a terminal."""
    console = stderr()
    if not console.is_terminal:
        yield BatchProgress(None, total)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[bad]}"),
        TextColumn("[dim]{task.fields[now]}"),
    )
    with Progress(*columns, console=console, transient=True, refresh_per_second=5) as bar:
        yield BatchProgress(bar, total)
