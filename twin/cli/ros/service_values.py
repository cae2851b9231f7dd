"""Requests, goals and other messages from the YAML of a command line."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

import typer

from twin.errors import COMPARED, BridgeError, nearest


def message_of(cls: type[Any], text: str) -> Any:
    """Return a message from YAML such as '{a: 1, b: 2}'.

    Raises:
        BridgeError: no YAML, an unknown field or a value that does not fit.
    """
    import yaml

    from twin.bridge.messages.as_yaml import message_from_dict

    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        reason = " ".join(str(error).split())
        raise BridgeError(f"{text!r} is no YAML: {reason}; valid is for example '{{a: 1, b: 2}}'") from error
    return message_from_dict(cls, values)


def text_of(values: str | None, stdin: bool) -> str:
    """Return the values given as an argument or, if wanted, on standard input; '{}' if there are none.

    Raises:
        BridgeError: both.
    """
    if stdin and values is not None:
        raise BridgeError("values are given as an argument and with --stdin; valid is one of both")
    return sys.stdin.read() if stdin else values or "{}"


def unknown(kind: str, name: str, known: object) -> BridgeError:
    """Return the error that something is not in the graph, with the nearest name."""
    names = [str(each) for each in known] if isinstance(known, (dict, list, tuple, set)) else []
    hint = nearest(name, names) if names else f"there are no {kind}s"
    return BridgeError(f"Unknown {kind} '{name}'; {hint}")


def hint_at_nearest(kind: str, name: str, known: Iterable[str]) -> None:
    """Say on stderr, before a wait that may last for ever, that something else has nearly this name."""
    import difflib

    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5) if len(names) <= COMPARED else []
    if close:
        typer.echo(f"WARNING: there is no {kind} {name} yet; did you mean {close[0]}?", err=True)


def absolute(name: str) -> str:
    """Return a name with the slash in front that a person may leave out."""
    return name if name.startswith("/") else f"/{name}"
