"""Nodes from a user's file: `FILE.py:FACTORY`, a function that takes a bus and returns a node or several."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import BridgeError, Problem, nearest
from twin.plugins.execution import run_file

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node

_FORM = "valid: FILE.py:FUNCTION, where FUNCTION takes the bus and returns its node or a list of nodes"


def create_nodes(bus: Bus, place: str) -> tuple[Node, ...]:
    """Import the file and call the function; return the nodes that it made.

    Raises:
        BridgeError: not of this form, no such file or function, or an exception in it: with file and line.
    """
    from twin.bridge.node import Node

    file, function = _function(place)
    try:
        made = function(bus)
    except BridgeError:
        raise
    except Exception as error:
        raise _fault(file, error) from error
    nodes = tuple(made) if isinstance(made, list | tuple) else (made,)
    if not nodes or not all(isinstance(node, Node) for node in nodes):
        kind = type(made).__name__
        raise BridgeError(Problem(f"{place.rpartition(':')[2]} returned {kind}, not a node; {_FORM}", file))
    return nodes


def _function(place: str) -> tuple[Path, Callable[[Bus], Any]]:
    name, _, function = place.rpartition(":")
    file = Path(name)
    if not name or not function.isidentifier():
        raise BridgeError(f"{place} names no nodes; {_FORM}")
    if not file.is_file():
        raise BridgeError(f"{file}: there is no such file; {_FORM}")
    if file.suffix != ".py":
        raise BridgeError(f"{file}: not a Python file; {_FORM}")
    try:
        module = run_file(file, function)
    except Exception as error:
        raise _fault(file, error) from error
    found = getattr(module, function, None)
    if not callable(found):
        names = [n for n, value in vars(module).items() if callable(value) and not n.startswith("_")]
        raise BridgeError(Problem(f"there is no function {function}; {nearest(function, names)}", file))
    return file, found


def _fault(file: Path, error: Exception) -> BridgeError:
    """Return what went wrong, and the last line of the user's file that was running."""
    if isinstance(error, SyntaxError) and error.filename:
        return BridgeError(Problem(f"SyntaxError: {error.msg}", Path(error.filename), error.lineno))
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).resolve() == file.resolve()
    ]
    return BridgeError(Problem(f"{type(error).__name__}: {error}", file, lines[-1] if lines else None))
