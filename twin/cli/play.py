"""`twin play`: look at a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.errors import RecordingError
from twin.files.writing import check_file


def play(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING", help="A recording (*.rrd), or the folder of a run.", show_default=False
        ),
    ],
    web: Annotated[
        bool, typer.Option("--web", help="Serve the viewer to a browser on this computer.")
    ] = False,
    port: Annotated[int, typer.Option(help="Port of the page with --web.")] = 9090,
    screenshot: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Write a picture of the screen instead; needs no display."),
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            help="Simulated time of the picture.",
            show_default="start; of a graph its end",
        ),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="One view, such as Map.", show_default="the whole screen"),
    ] = None,
) -> None:
    """Open a recording in the Rerun viewer."""
    from twin.cli.console import stderr
    from twin.recording import player

    file = find_recording(recording)
    if screenshot is not None:
        check_file(screenshot, "--screenshot")
        player.screenshot(file, screenshot, time_s=at, view=view)
    elif at is not None or view is not None:
        raise typer.BadParameter("--at and --view are of a picture: add --screenshot PNG")
    if not web and (lacking := player.unshown(file)):
        stderr().print(lacking, markup=False)
    if screenshot is not None:
        return
    raise typer.Exit(
        player.play(file, web=web, port=port, on_ready=lambda url: stderr().print(f"open {url}"))
    )


def find_recording(path: Path) -> Path:
    """Return the recording that a path means; raises RecordingError."""
    if path.is_dir():
        found = sorted(path.glob("*.rrd"))
        if len(found) != 1:
            names = ", ".join(file.name for file in found) or "none"
            raise RecordingError(f"{path}: the folder must hold one recording (*.rrd), it holds {names}")
        return found[0]
    if not path.exists():
        raise RecordingError(f"{path}: no such recording; `twin run` writes it to runs/<scenario>/<time>/")
    if path.suffix != ".rrd":
        raise RecordingError(f"{path}: not a Rerun recording; valid: *.rrd")
    return path
