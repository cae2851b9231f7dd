"""`twin robots`: the catalogue of models."""

from __future__ import annotations


def robots() -> None:
    """List the robots that ship with twin; a scenario names them as `model`."""
    from rich.table import Table
    from rich.text import Text

    from twin.cli.console import stdout
    from twin.models.catalogue import catalogue

    table = Table(box=None)
    table.add_column("model", style="bold", no_wrap=True)
    table.add_column("file", overflow="fold")
    for name, path in catalogue().items():
        table.add_row(Text(name), Text(str(path)))
    stdout().print(table)
