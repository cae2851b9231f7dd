"""The `twin` command: thin commands that parse, call one library function, print, and set the exit code."""

from __future__ import annotations


def main() -> None:
    """Run `twin`; a user's mistake ends as one sentence on stderr and exit code 2."""
    import sys

    try:
        from twin.cli.app import run_app

        run_app()
    except KeyboardInterrupt:  # while something is imported, or an error is printed
        sys.exit(130)
