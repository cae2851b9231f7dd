"""The command line of a program of its own: what its factory takes, and how it joins a graph."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

_JOINING = ("connect", "listen", "config", "domain_id", "use_sim_time")


def parser_of(make: Callable[..., Any]) -> argparse.ArgumentParser:
    """Return a parser of the factory's own arguments and of those of `live.join`.

    The parameters of `make` after the first one, the bus, are the program's: those with a default may be
    left out, keyword-only ones are options (`cancel_after: float = 0.0` is --cancel-after). Their annotations
    say how text is read; the first paragraph of the docstring is the help.
    """
    parser = argparse.ArgumentParser(
        description=(inspect.getdoc(make) or "").partition("\n\n")[0],
        argument_default=argparse.SUPPRESS,
        allow_abbrev=False,
    )
    parser.add_argument(
        "--connect", action="append", metavar="ENDPOINT", help="where a run or router listens"
    )
    parser.add_argument("--listen", action="append", metavar="ENDPOINT", help="where others may connect")
    parser.add_argument("--config", type=Path, metavar="FILE", help="Zenoh configuration")
    parser.add_argument("--domain", type=int, dest="domain_id", metavar="ID", help="ROS domain")
    parser.add_argument("--use-sim-time", action="store_true", help="take the time from /clock")
    for parameter in list(inspect.signature(make, eval_str=True).parameters.values())[1:]:
        _add(parser, parameter)
    return parser


def split(given: argparse.Namespace) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the keyword arguments of `live.join`, and those of the factory."""
    values = vars(given)
    return (
        {name: value for name, value in values.items() if name in _JOINING},
        {name: value for name, value in values.items() if name not in _JOINING},
    )


def _add(parser: argparse.ArgumentParser, parameter: inspect.Parameter) -> None:
    option = parameter.kind is inspect.Parameter.KEYWORD_ONLY
    name = f"--{parameter.name.replace('_', '-')}" if option else parameter.name
    if parameter.annotation is bool:
        parser.add_argument(name, action="store_true")
        return
    kind = parameter.annotation if callable(parameter.annotation) else str
    needed = parameter.default is inspect.Parameter.empty
    if option:
        parser.add_argument(name, type=kind, required=needed, metavar=kind.__name__.upper())
    else:
        parser.add_argument(name, type=kind, nargs=None if needed else "?")
