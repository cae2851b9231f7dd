"""`twin report`: a page of a run, or of many."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.cli.console import stdout


def report(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Folder of a run, or of many, as `twin test` writes it.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="The page.", show_default="<RUN>/report.html"),
    ] = None,
) -> None:
    """Write a page of a run, or of many: verdict, path, speeds, worst moments, pictures.

    It is one HTML file, which needs no network and can be printed.
    """
    from rich.text import Text

    from twin.experiments.report.page import write_report

    file = output or run / "report.html"
    count = write_report(run, file)
    stdout().print(Text(f"{file}: {count} run{'s' if count != 1 else ''}"))
