"""The command line of a program of its own: what its factory takes, how it joins a graph, ROS's arguments.

These are `--ros-args -r from:=to -p name:=value --params-file FILE --`; source: rcl/arguments.h.
"""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twin.bridge import names
from twin.bridge.node.logger import LEVELS
from twin.bridge.parameters import files as parameter_files
from twin.errors import BridgeError, nearest

_WITH_VALUE = {
    "-r": "remap",
    "--remap": "remap",
    "-p": "param",
    "--param": "param",
    "--params-file": "params_file",
    "--log-level": "log_level",
    "-e": "ignored",
    "--enclave": "ignored",
    "--log-config-file": "ignored",
    "--log-file-name": "ignored",
}
_SWITCHES = {
    f"--{verb}-{what}-logs" for verb in ("enable", "disable") for what in ("rosout", "stdout", "external-lib")
}


@dataclass(frozen=True, kw_only=True)
class RosArguments:
    """What the arguments of a program say to its nodes."""

    remappings: tuple[names.RemapRule, ...] = ()
    sections: tuple[parameter_files.Section, ...] = ()
    """Of the parameter files."""
    parameters: tuple[tuple[str, str, Any], ...] = ()
    """Given by `-p`, and stronger than the files: node, empty for all; name; value."""
    log_levels: tuple[tuple[str, int], ...] = ()
    """Logger name, empty for all, and severity."""
    rest: tuple[str, ...] = ()
    """What is not for ROS, in order."""

    def parameters_for(self, full_name: str) -> dict[str, Any]:
        """Return the values for a node, by parameter name."""
        found = parameter_files.values_for(self.sections, full_name)
        for node, name, value in self.parameters:
            if node in ("", full_name, full_name.rpartition("/")[2]):
                found[name] = value
        return found


def parse(arguments: Sequence[str]) -> RosArguments:
    """Read a program's arguments, `sys.argv[1:]`; what is between `--ros-args` and `--` is for ROS.

    Raises:
        BridgeError: an unknown or incomplete ROS argument, or a parameter file that cannot be read.
    """
    remappings: list[names.RemapRule] = []
    sections: list[parameter_files.Section] = []
    parameters: list[tuple[str, str, Any]] = []
    levels: list[tuple[str, int]] = []
    actions: dict[str, Callable[[str], None]] = {
        "remap": lambda text: remappings.append(names.RemapRule.parse(text)),
        "param": lambda text: parameters.append(_parameter(text)),
        "params_file": lambda text: sections.extend(parameter_files.read(Path(text))),
        "log_level": lambda text: levels.append(_log_level(text)),
        "ignored": lambda text: None,
    }
    rest: list[str] = []
    given = iter(arguments)
    for argument in given:
        if argument == "--ros-args":
            _read_ros(given, actions)
        else:
            rest.append(argument)
    return RosArguments(
        remappings=tuple(remappings),
        sections=tuple(sections),
        parameters=tuple(parameters),
        log_levels=tuple(levels),
        rest=tuple(rest),
    )


def _read_ros(arguments: Iterator[str], actions: dict[str, Callable[[str], None]]) -> None:
    for argument in arguments:
        if argument == "--":
            return
        if argument in _SWITCHES or argument == "--ros-args":
            continue
        if argument not in _WITH_VALUE:
            known = nearest(argument, [*_WITH_VALUE, *_SWITCHES])
            raise BridgeError(f"{argument!r} after --ros-args is not known; {known}")
        value = next(arguments, None)
        if value is None:
            raise BridgeError(f"nothing follows {argument} at the end of the arguments")
        actions[_WITH_VALUE[argument]](value)


def _parameter(text: str) -> tuple[str, str, Any]:
    left, found, value = text.partition(":=")
    node, _, name = left.rpartition(":")
    if not (found and name):
        raise BridgeError(f"{text!r} is no parameter; valid: name:=value, node:name:=value")
    return node, name, parameter_files.scalar(value)


def _log_level(text: str) -> tuple[str, int]:
    name, found, word = text.partition(":=")
    level = LEVELS.get((word if found else text).upper())
    if level is None:
        raise BridgeError(f"{text!r} is no log level; valid: {', '.join(LEVELS)}, or logger:=LEVEL")
    return name if found else "", level


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
