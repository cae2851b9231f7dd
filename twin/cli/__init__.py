"""The `twin` command: thin commands that parse, call one library function, print, and set the exit code."""

from __future__ import annotations

from twin.cli.interrupted import ends_on_interrupt


def main() -> None:
    """Run `twin`; a user's mistake ends as one sentence on stderr and exit code 2."""
    with ends_on_interrupt():
        from twin.cli.app import run_app

        run_app()
