"""`twin schema`: the JSON schema of scenario files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def schema(
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="File to write.", show_default="standard output"),
    ] = None,
) -> None:
    """Print the JSON schema of scenario files, for completion and checks in an editor."""
    import json
    import sys

    from twin.files.writing import check_file, write_whole

    if output is not None:
        check_file(output)
    from twin.scenario.schema import json_schema

    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        sys.stdout.write(text)
    else:
        write_whole(output, text)
