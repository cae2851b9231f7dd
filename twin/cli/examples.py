"""`twin examples`: programs to read, copy and run."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from twin.cli import completion
from twin.errors import TwinError, nearest
from twin.files.reading import read_text
from twin.files.shipped import beside


def examples(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="EXAMPLE",
            help="Print only the path of this one's file.",
            show_default="a list of all",
            autocompletion=completion.examples,
        ),
    ] = None,
) -> None:
    """List the example programs, or say where one is: `python $(twin examples talker)` runs it."""
    programs = catalogue()
    if name is None:
        from twin.cli.console import print_table

        print_table(("example", "what it does"), [(each, _purpose(file)) for each, file in programs.items()])
    elif name in programs:
        typer.echo(programs[name])
    else:
        raise TwinError(f"no example '{name}': {nearest(name, programs)}")


def catalogue() -> Mapping[str, Path]:
    """Return the files of the programs by name; modules that they share are none."""
    files = sorted(beside("examples").rglob("*.py"))
    return {file.stem: file for file in files if "__main__" in read_text(file)}


def _purpose(file: Path) -> str:
    """Return the first line of a program's docstring without the command that follows it."""
    said = (ast.get_docstring(ast.parse(read_text(file))) or "").partition("\n")[0]
    return said.partition(": `")[0]
