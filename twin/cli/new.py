"""`twin new`: a project of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def new(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="A new folder; its last part names project and robot.", show_default=False
        ),
    ],
) -> None:
    """Write a small project that runs as it is: a robot, an arena, a scenario, a check, a test, a CI file."""
    from twin.project import create

    create(folder)
    here, there = Path.cwd(), folder.resolve()
    typer.echo(
        f"{folder}: a robot, an arena, a scenario, a check and a test; README.md says which file is what"
    )
    typer.echo(f"next: {'' if here == there else f'cd {folder} && '}twin run {there.name}")
