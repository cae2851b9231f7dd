"""The command `twin`. Modules of its commands import the heavy libraries only inside their functions."""

from __future__ import annotations

import errno
import os
import sys
from typing import Annotated

import typer

from twin.cli.console import guard_terminal, print_error
from twin.cli.interrupted import raise_swallowed
from twin.cli.option_groups import example
from twin.cli.other_commands import Commands
from twin.errors import TwinError

app = typer.Typer(
    name="twin",
    cls=Commands,
    help="A digital twin for mobile robots: robot files, physics, autonomy, recordings, verdicts, ROS 2.",
    epilog=example("twin run warehouse"),
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def _tell_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"twin {version('twin')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_tell_version, help="Say which twin this is.")
    ] = False,
) -> None:
    pass


def run_app() -> None:
    """Run the command line and exit: 0 pass, 1 a check failed, 2 a mistake or a bug, 130 interrupted."""
    if sys.stdout is None:  # started with `>&-`
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - used until the process ends
    guard_terminal()
    try:
        app()
    except TwinError as fault:
        print_error(fault)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as fault:
        raise_swallowed()  # Ctrl-C inside of __set_name__ becomes a RuntimeError
        _tell(fault)
        sys.exit(2)  # Python's own exit code for a bug, 1, means a failed check here


def _tell(fault: Exception) -> None:
    """Tell of a full disk or an impossible name in a sentence; of a bug with its traceback."""
    if isinstance(fault, OSError) and fault.errno == errno.ENAMETOOLONG:
        print_error(TwinError(f"{fault.filename}: {fault.strerror}"))
        return
    if not isinstance(fault, OSError) or fault.errno not in _FULL:
        import traceback

        traceback.print_exception(fault)
        return
    what = fault.filename or "a file that was written"
    print_error(TwinError(f"{fault.strerror}: {what} is not whole; make room"))
    # What is still buffered goes nowhere; otherwise the interpreter complains when it flushes at its end.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
