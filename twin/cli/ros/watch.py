"""`twin watch`: a graph on a screen, live."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from twin.cli.interrupted import raise_swallowed
from twin.cli.ros.endings import endless
from twin.cli.ros.joining import PATIENCE_S, Joining, joins

_BLOCK_S = 0.1
"""How often what has come is drawn."""
_GATHER_S = 1.0
"""How long is waited for more when there is something to draw, so that the first screen is whole."""


@joins
@endless
def watch(
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topics",
            metavar="PATTERN",
            help="Only topics of this name, such as /scan or '/camera/*', and transforms; repeatable.",
            show_default="all that can be drawn",
        ),
    ] = None,
    web: Annotated[
        bool, typer.Option("--web", help="Serve a page on this computer, open no window.")
    ] = False,
    save: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.rrd", help="Write a recording for `twin play`; opens no viewer without --web."
        ),
    ] = None,
    duration: Annotated[
        float | None, typer.Option("--for", metavar="S", min=0.0, help="End after so many seconds.")
    ] = None,
    *,
    joining: Joining,
) -> None:
    """Show a run or any ROS 2 graph in the Rerun viewer, live: RViz's job."""
    from twin.recording.live_screen import LiveScreen
    from twin.recording.watch.watcher import WatchConfig, Watcher

    screen = LiveScreen(_tell, web=web or None) if web or save is None else None
    with joining.open(PATIENCE_S) as process:
        watcher = Watcher(process, _tell, WatchConfig(topics=tuple(topics or ())))
        end = None if duration is None else time.monotonic() + duration

        def is_over() -> bool:
            raise_swallowed()  # as while Rerun draws
            return end is not None and time.monotonic() >= end

        try:
            if not watcher.is_ready:
                process.spin(lambda: watcher.is_ready, 1.0)
            if not watcher.is_ready:
                _tell("nobody publishes what could be drawn; waiting")
                process.spin(lambda: watcher.is_ready or is_over())
            process.spin(is_over, _GATHER_S)
            watcher.open(save, screen)
            while not is_over() and (screen is None or screen.is_open):
                process.spin(is_over, _BLOCK_S)
                watcher.update()
        finally:
            try:
                watcher.close()
            finally:
                if screen is not None:
                    screen.close()
                if watcher.dropped:
                    _tell(f"{watcher.dropped} messages were not drawn, as newer ones came")


def _tell(sentence: str) -> None:
    typer.echo(sentence, err=True)
