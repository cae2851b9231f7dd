"""`twin play`: look at a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.errors import RecordingError


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
) -> None:
    """Open a recording in the Rerun viewer."""
    from twin.cli.console import stderr
    from twin.recording import player

    file = find_recording(recording)
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
