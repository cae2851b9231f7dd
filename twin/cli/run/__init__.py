"""`twin run`: one scenario to its verdict."""

from __future__ import annotations

import typer

from twin.cli.option_groups import takes
from twin.cli.run.options import RunOptions


@takes("options", RunOptions)
def run(*, options: RunOptions) -> None:
    """Run a scenario to its verdict.

    Exit code 0: every check holds; 1: one fails; 2: the run could not be made.
    """
    if options.repeat == 1 and not options.expect_one_hash:
        from twin.cli.run.once import run_once

        raise typer.Exit(run_once(options))
    from twin.cli.run.batch import run_repeatedly

    raise typer.Exit(run_repeatedly(options))
